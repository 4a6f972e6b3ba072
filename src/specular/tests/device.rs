//! The kernel against its twin, to the bit, and faults planted into it.

use super::tier::faults_in_turn;
use crate::device::Solver;
use crate::newton::{Search, Solved};
use crate::path::Form;
use crate::real::V3;
use crate::reflector::Shape;
use crate::scene::{Mirror, random_begins, setup, spread_begins, vertices};
use crate::solve::reflect_vertex;
use glam::DVec3;
use raystone_gpu::{AdapterChoice, Gpu, KernelLibrary, probe_arithmetic};

fn adapter() -> Option<Gpu> {
    let gpu = raystone_gpu::open(&AdapterChoice::Best, KernelLibrary::default());
    let gpu = gpu.unwrap_or_else(|e| panic!("no adapter: run scripts/install-driver ({e})"));
    let exact = probe_arithmetic(&gpu).unwrap().is_exact();
    if !exact {
        eprintln!("skipped for want of an adapter that computes like the host");
    }
    exact.then_some(gpu)
}

/// A way to search, as a case of the tests.
#[derive(Debug, Clone, Copy)]
enum Way {
    Secants(u32),
    Random,
    Differences,
    Exact,
    Several,
}

const WAYS: [Way; 7] = [
    Way::Secants(0),
    Way::Secants(1),
    Way::Secants(2),
    Way::Random,
    Way::Differences,
    Way::Exact,
    Way::Several,
];

fn search(way: Way) -> Search<f32> {
    let several = matches!(way, Way::Several);
    Search {
        is_newton: matches!(way, Way::Differences | Way::Exact | Way::Several),
        is_exact: matches!(way, Way::Exact),
        stop: if let Way::Secants(stop) = way {
            stop
        } else {
            2
        },
        merit: u32::from(several),
        is_given: matches!(way, Way::Random),
        starts: if several { 12 } else { 1 },
        most: 60,
        singular: 1e-6,
        difference: 1e-3,
    }
}

struct Case {
    mirror: Mirror,
    own: Vec<DVec3>,
}

fn case(shape: Shape) -> Case {
    let mirror = Mirror {
        shape,
        amplitude: 0.05,
        frequency: 10.0,
    };
    let all = vertices(&mirror, &mirror.oracle(), 0.0, 256, 17).unwrap();
    let own = all.iter().map(|vertex| vertex.v).collect();
    Case { mirror, own }
}

fn begins(case: &Case, way: Way) -> Vec<DVec3> {
    let all = match way {
        Way::Random => random_begins(&case.mirror, case.own.len(), 3),
        Way::Several => spread_begins(&case.mirror, 12),
        _ => Vec::new(),
    };
    all.iter().map(|u| u.as_vec3().as_dvec3()).collect()
}

fn on_device(gpu: &Gpu, case: &Case, form: Form, way: Way) -> Vec<Solved<f32>> {
    let setup = setup(&case.mirror, form, 0.0);
    let solver = Solver::new(gpu, &setup, &search(way), &case.own, &begins(case, way));
    solver.unwrap().solve().unwrap().0
}

fn by_twin(case: &Case, form: Form, way: Way) -> Vec<Solved<f32>> {
    let setup = setup(&case.mirror, form, 0.0);
    let all = begins(case, way);
    let own = |k: usize| match way {
        Way::Random => all[3 * k..3 * k + 3].to_vec(),
        _ => all.clone(),
    };
    let each = case.own.iter().enumerate().map(|(k, v)| {
        let begins: Vec<V3<f32>> = own(k).iter().map(|u| V3::of(*u)).collect();
        reflect_vertex(setup, search(way), V3::of(*v), &begins)
    });
    each.collect()
}

#[test]
fn the_kernel_searches_as_its_twin_does() {
    let Some(gpu) = adapter() else { return };
    for shape in Shape::ALL {
        let case = case(shape);
        for way in WAYS {
            let found = on_device(&gpu, &case, Form::Transposed, way);
            let twin = by_twin(&case, Form::Transposed, way);
            let differing = found.iter().zip(&twin).find(|(a, b)| a != b);
            assert_eq!(differing, None, "{shape:?} {way:?}");
        }
        for form in [Form::AsPrinted, Form::SignMended, Form::Intrinsic] {
            let found = on_device(&gpu, &case, form, Way::Secants(0));
            assert_eq!(
                found,
                by_twin(&case, form, Way::Secants(0)),
                "{shape:?} {form:?}"
            );
        }
    }
}

/// Shape and way that show it, kernel, text, its replacement.
type Fault = (Shape, Way, &'static str, &'static str, &'static str);

const FAULTS: [Fault; 22] = [
    // A wrong sign of the second leg.
    (
        Shape::Sphere,
        Way::Secants(0),
        "path",
        "return unit(p - setup.eye) - unit(v - p);",
        "return unit(p - setup.eye) + unit(v - p);",
    ),
    // The derivative not transposed.
    (
        Shape::Bumpy,
        Way::Secants(0),
        "path",
        "slope * along + (e - u * along)",
        "u * dot3(slope, e) + (e - u * along)",
    ),
    // The normal's cosine forgotten.
    (
        Shape::Ellipsoid,
        Way::Secants(0),
        "path",
        "m / max(dot3(m, u), LEAST_COSINE)",
        "unit(m)",
    ),
    (
        Shape::Sphere,
        Way::Secants(0),
        "path",
        "setup.pixels / max(",
        "2.0 * setup.pixels / max(",
    ),
    // Another threshold.
    (
        Shape::Sphere,
        Way::Secants(0),
        "secant",
        "abs(twice) < 2.0",
        "abs(twice) < 1.0",
    ),
    (
        Shape::Sphere,
        Way::Secants(1),
        "secant",
        "max(max(apart(a, b), apart(b, d)), apart(d, a))",
        "max(apart(a, b), apart(b, d))",
    ),
    (
        Shape::Sphere,
        Way::Secants(2),
        "secant",
        "edge < 1.0 && (*s)",
        "edge < 1.0 || (*s)",
    ),
    // No backtracking.
    (
        Shape::Bumpy,
        Way::Secants(2),
        "secant",
        "if (!has_out) {",
        "if (true) {",
    ),
    // The newest sample thrown out again.
    (
        Shape::Bumpy,
        Way::Secants(2),
        "secant",
        "last_in = worst(&s, last_in);",
        "last_in = worst(&s, NONE);",
    ),
    (
        Shape::Bumpy,
        Way::Secants(0),
        "secant",
        "let determinant = aa * bb - ab * ab;",
        "let determinant = aa * bb + ab * ab;",
    ),
    (
        Shape::Sphere,
        Way::Secants(0),
        "secant",
        "(1.0 - alpha - beta)",
        "(1.0 - alpha)",
    ),
    (
        Shape::Sphere,
        Way::Secants(0),
        "secant",
        "HALF_ROOT_3 * length",
        "length",
    ),
    // A wrong Hessian.
    (
        Shape::Bumpy,
        Way::Exact,
        "newton",
        "- bend_of(setup.reflector, p, t) * multiplier",
        "+ bend_of(setup.reflector, p, t) * multiplier",
    ),
    (
        Shape::Bumpy,
        Way::Exact,
        "newton",
        "vec3<f32>(dot3(right, x), dot3(right, y), dot3(up, y))",
        "vec3<f32>(dot3(right, x), 0.0, dot3(up, y))",
    ),
    (
        Shape::Bumpy,
        Way::Differences,
        "newton",
        "* 0.5;\n    return System(",
        ";\n    return System(",
    ),
    (Shape::Bumpy, Way::Differences, "newton", "&& h.x > 0.0", ""),
    (
        Shape::Bumpy,
        Way::Differences,
        "newton",
        "HALVINGS + 1u",
        "1u",
    ),
    (
        Shape::Bumpy,
        Way::Exact,
        "reflector",
        "- flat_part * radial",
        "",
    ),
    (
        Shape::Torus,
        Way::Exact,
        "reflector",
        "+ along + across * part",
        "+ along + across",
    ),
    (
        Shape::Ellipsoid,
        Way::Exact,
        "reflector",
        "v.y * AXIS_Y, v.z * AXIS_Z",
        "v.y * AXIS_Z, v.z * AXIS_Y",
    ),
    (
        Shape::Bumpy,
        Way::Several,
        "solve",
        "its_length < length",
        "its_length > length",
    ),
    (
        Shape::Concave,
        Way::Secants(0),
        "reflector",
        "reflector.shape == CONCAVE && u.x > 0.0",
        "reflector.shape == CONCAVE && u.x < 0.0",
    ),
];

#[test]
fn faults_of_the_kernel_are_seen() {
    let Some(gpu) = adapter() else { return };
    let mut unseen = Vec::new();
    for (shape, way, file, text, fault) in faults_in_turn("faults of the specular search", FAULTS) {
        let library = KernelLibrary::default();
        let name = format!("specular/{file}");
        let sound = library
            .text(&name)
            .unwrap_or_else(|| panic!("there is no {name}"));
        assert_eq!(sound.matches(text).count(), 1, "{name}: `{text}`");
        let changed = sound.replace(text, fault);
        let faulty = gpu.with_kernels(library.with_sources(&[(&name, &changed)]));
        let case = case(shape);
        if on_device(&faulty, &case, Form::Transposed, way) == by_twin(&case, Form::Transposed, way)
        {
            unseen.push(text);
        }
    }
    assert!(unseen.is_empty(), "not seen: {unseen:?}");
}
