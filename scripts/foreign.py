"""What scripts/validate and scripts/compare-mitsuba share: Mitsuba 3 in an environment of its own, images of both
renderers, and the test of whether they agree.

Environment:
  RAYSTONE            the program, instead of target/release/raystone
  DRJIT_LIBLLVM_PATH  the library of LLVM (16 or newer) for Mitsuba's variant llvm_ad_rgb, instead of one found
"""

import ctypes.util
import glob
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
HOME = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "mitsuba"
PROGRAM = os.environ.get("RAYSTONE", str(Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release/raystone"))
# Exit code of what was not done because Mitsuba cannot be installed here.
SKIPPED = 77


def skip(reason):
    print(f"skipped: {reason}", file=sys.stderr)
    sys.exit(SKIPPED)


def enter():
    """Starts this script again with a Python that has Mitsuba: made below target/ the first time."""
    python = HOME / "venv/bin/python"
    if Path(sys.prefix) == HOME / "venv":
        return
    if not python.exists():
        print("installing Mitsuba 3 into", HOME, file=sys.stderr)
        made = subprocess.run([sys.executable, "-m", "venv", str(HOME / "venv")])
        if made.returncode:
            skip("Python cannot make an environment (Debian: apt-get install python3-venv)")
    if subprocess.run([python, "-c", "import mitsuba, numpy"], capture_output=True).returncode:
        if subprocess.run([python, "-m", "pip", "install", "-q", "mitsuba>=3.7", "numpy"]).returncode:
            skip("pip cannot install Mitsuba 3 here (no network, or no package for this Python)")
    os.execv(python, [str(python), *sys.argv])


def llvm():
    """The path of a library of LLVM that Mitsuba can use, or None. Older ones than 16 abort the process."""
    given = os.environ.get("DRJIT_LIBLLVM_PATH")
    if given:
        return given
    found = []
    for pattern in ["/usr/lib/*/libLLVM*.so*", "/usr/lib/llvm-*/lib/libLLVM*.so*", "/usr/lib64/libLLVM*.so*", f"{HOME}/llvm/**/libLLVM*.so*"]:
        for path in glob.glob(pattern, recursive=True):
            numbers = [int(w) for w in Path(path).name.replace("-", ".").split(".") if w.isdigit()]
            if numbers and numbers[0] >= 16:
                found.append((numbers[0], path))
    if found:
        return max(found)[1]
    folder = HOME / "llvm"
    if shutil.which("apt-get") and not folder.exists():
        folder.mkdir(parents=True)
        subprocess.run("apt-get -qq download libllvm19 || apt-get -qq download libllvm16", shell=True, cwd=folder, capture_output=True)
        for package in folder.glob("*.deb"):
            subprocess.run(["dpkg", "-x", str(package), str(folder)])
        return llvm()
    return None


def load(variant=None):
    """The module mitsuba with a variant: the one given, else that of LLVM, else the scalar one."""
    library = llvm()
    if library:
        os.environ["DRJIT_LIBLLVM_PATH"] = library
    import mitsuba

    mitsuba.set_variant(variant or ("llvm_ad_rgb" if library else "scalar_rgb"))
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    return mitsuba


def ours(scene, size, spp, seed, flags, folder, name="ours.npy"):
    """An image of ours as an array [height, width, 3]."""
    import numpy

    file = folder / name
    command = [PROGRAM, "render", "--scene", scene, "--size", f"{size[0]}x{size[1]}", "--spp", str(spp), "--seed", str(seed), *flags, "-o", str(file)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stderr}")
    return numpy.load(file).astype(numpy.float64)


def export(scene, size, flags, folder):
    """Writes the scene for Mitsuba; its file."""
    command = [PROGRAM, "export", scene, "--to", "mitsuba", "--size", f"{size[0]}x{size[1]}", *flags, "--out", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stderr}")
    if done.stderr:
        print(done.stderr.strip(), file=sys.stderr)
    return done.stdout.strip()


def teach(file):
    """Imports the materials that an exported scene brings, once for all: every scene's are the same."""
    path = Path(file).parent / "materials.py"
    if path.exists() and "raystone_materials" not in sys.modules:
        import importlib.util

        found = importlib.util.spec_from_file_location("raystone_materials", path)
        sys.modules["raystone_materials"] = module = importlib.util.module_from_spec(found)
        found.loader.exec_module(module)


def theirs(mitsuba, file, spp, seed, sampler="multijitter"):
    """An image of Mitsuba's as an array."""
    import numpy

    teach(file)
    scene = mitsuba.load_file(file, sampler=sampler)
    return numpy.array(mitsuba.render(scene, spp=spp, seed=seed), dtype=numpy.float64)


def moments(images):
    """Mean over replicates, and the variance of that mean."""
    import numpy

    images = numpy.asarray(images)
    return images.mean(axis=0), images.var(axis=0, ddof=1) / len(images)


def tiles(image, edge):
    height, width = image.shape[0] // edge * edge, image.shape[1] // edge * edge
    cut = image[:height, :width]
    return cut.reshape(height // edge, edge, width // edge, edge, -1).mean(axis=(1, 3))


LUMINANCE = (0.212671, 0.715160, 0.072169)


def agreement(ours, theirs, edge=8):
    """Compares two lists of replicates, luminance by luminance: the ratio of the means with its standard error, the share of
    pixels and of tiles that a Welch test accepts at the Šidák level 0.01 (each at 1 - 0.99^(1/n))."""
    import numpy

    a, b = (numpy.asarray(x) @ numpy.array(LUMINANCE) for x in (ours, theirs))
    whole = [x.mean(axis=(1, 2)) for x in (a, b)]
    (ma, va), (mb, vb) = (moments(x) for x in whole)
    result = {"ratio": ma / mb, "error": numpy.sqrt(va / ma**2 + vb / mb**2), "channels": numpy.asarray(ours).mean(axis=(0, 1, 2)) / numpy.asarray(theirs).mean(axis=(0, 1, 2))}
    for what, size in [("pixels", 1), ("tiles", edge)]:
        x, y = (numpy.stack([tiles(i[..., None], size)[..., 0] for i in s]) for s in (a, b))
        (mx, vx), (my, vy) = moments(x), moments(y)
        accepted = welch(mx, vx, len(x), my, vy, len(y)) >= 1 - 0.99 ** (1 / mx.size)
        result[what] = accepted.mean()
    return result


def welch(ma, va, na, mb, vb, nb):
    """Two-sided p-values of the difference of means with these variances of the means."""
    import numpy

    total = va + vb
    # Rounding of f32 sums, and pixels that every replicate has alike.
    floor = (1e-5 * numpy.maximum(abs(ma), abs(mb))) ** 2 + 1e-30
    z = abs(ma - mb) / numpy.sqrt(total + floor)
    freedom = total**2 / (va**2 / (na - 1) + vb**2 / (nb - 1) + 1e-300)
    freedom = numpy.where(total > 0, freedom, na + nb - 2)
    return student(z, freedom)


def student(t, freedom):
    """Two-sided tail of Student's distribution: the incomplete beta function by its continued fraction (Lentz)."""
    import numpy
    from math import lgamma

    t, freedom = numpy.broadcast_arrays(numpy.asarray(t, float), numpy.asarray(freedom, float))
    a, b, x = freedom / 2, 0.5, freedom / (freedom + t * t)
    swap = x > (a + 1) / (a + b + 2)
    p, q, y = numpy.where(swap, b, a), numpy.where(swap, a, b), numpy.where(swap, 1 - x, x)
    y = numpy.clip(y, 1e-300, 1 - 1e-16)
    gamma = numpy.vectorize(lgamma)
    front = numpy.exp(gamma(a + b) - gamma(a) - gamma(numpy.full_like(a, b)) + p * numpy.log(y) + q * numpy.log1p(-y)) / p
    c, d = numpy.ones_like(y), 1 / (1 - (p + q) * y / (p + 1))
    h = d.copy()
    for m in range(1, 200):
        for e in (m * (q - m) * y / ((p + 2 * m - 1) * (p + 2 * m)), -(p + m) * (p + q + m) * y / ((p + 2 * m) * (p + 2 * m + 1))):
            d = 1 / (1 + e * d)
            c = 1 + e / c
            h *= c * d
    return numpy.clip(numpy.where(swap, 1 - front * h, front * h), 0, 1)


def pictures(ours, theirs, file):
    """Writes two mean images, tone-mapped alike, and their relative difference side by side as a PNG. The difference is white where both
    agree, red where the first is brighter, blue where it is darker, saturated at 10 %."""
    import numpy

    # Small enough for a page.
    edge = max(1, ours.shape[1] // 160)
    ours, theirs = tiles(ours, edge), tiles(theirs, edge)
    light = numpy.maximum(theirs @ numpy.array(LUMINANCE), 0)
    exposure = 0.36 / numpy.exp(numpy.log(light[light > 1e-6]).mean())

    def mapped(image):
        bright = numpy.maximum(image @ numpy.array(LUMINANCE), 0) * exposure
        return image * (exposure * (1 + bright / 16) / (1 + bright))[..., None]

    a, b = ours @ numpy.array(LUMINANCE), light
    d = numpy.clip((a - b) / numpy.maximum(b, 1e-3 * b.mean()) / 0.1, -1, 1)
    red, blue = 1 - numpy.maximum(-d, 0), 1 - numpy.maximum(d, 0)
    difference = numpy.stack([red, 1 - abs(d), blue], axis=-1) ** 2.2
    save(numpy.concatenate([mapped(ours), mapped(theirs), difference], axis=1), file)


def save(linear, file):
    import mitsuba
    import numpy

    bitmap = mitsuba.Bitmap(numpy.asarray(numpy.clip(linear, 0, 1), dtype=numpy.float32))
    Path(file).parent.mkdir(parents=True, exist_ok=True)
    bitmap.convert(mitsuba.Bitmap.PixelFormat.RGB, mitsuba.Struct.Type.UInt8, True).write(str(file))
