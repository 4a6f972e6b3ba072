# Shared by the scripts of this folder, which source it. Bash.
#
# Environment:
#   WGPU_BACKEND         chosen by the user: no driver is looked for, nothing is installed
#   RAYSTONE_NO_INSTALL  1: never install a driver, even where that would be possible
#   RAYSTONE_ICD_DIRS    folders (colon-separated) of Vulkan driver descriptions, instead of the
#                        system's; an empty or missing folder stands for "no driver"
#   RAYSTONE_OS_RELEASE  a file instead of /etc/os-release

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

say() { printf '%s\n' "$*" >&2; }

# die CODE MESSAGE…: 2 bad usage or toolchain, 3 no usable adapter.
die() {
    local code=$1
    shift
    say "$@"
    exit "$code"
}

# No pipe here ends early on its reader's side (`grep -q`, `head`): under pipefail the writer's
# SIGPIPE would turn success into failure.

# Paths are relative where the user stands in the repository, so that records name no folder of
# this machine.
if [ "$PWD" = "$root" ]; then prefix=""; else prefix="$root/"; fi

# ---- the system ---------------------------------------------------------------------------------

# os_field NAME: a field of os-release, without quotes; empty if unknown.
os_field() {
    sed -n "/^$1=/{s///;s/[\"']//g;p;q;}" "${RAYSTONE_OS_RELEASE:-/etc/os-release}" 2>/dev/null || true
}

is_debian_like() {
    case " $(os_field ID) $(os_field ID_LIKE) " in
    *" debian "* | *" ubuntu "*) command -v apt-get >/dev/null 2>&1 ;;
    *) return 1 ;;
    esac
}

# Runs a command as root; fails where that needs a password.
as_root() {
    if [ "$(id -u)" -eq 0 ]; then
        "$@"
    else
        sudo -n "$@"
    fi
}

can_be_root() {
    [ "$(id -u)" -eq 0 ] || { command -v sudo >/dev/null 2>&1 && sudo -n true 2>/dev/null; }
}

# by_system DEBIAN FEDORA ARCH SUSE ALPINE OTHER: prints the text for this system.
by_system() {
    case " $(os_field ID) $(os_field ID_LIKE) " in
    *" debian "* | *" ubuntu "*) printf '%s\n' "$1" ;;
    *" fedora "* | *" rhel "*) printf '%s\n' "$2" ;;
    *" arch "*) printf '%s\n' "$3" ;;
    *" suse "* | *" opensuse "* | *" opensuse-leap "* | *" opensuse-tumbleweed "*) printf '%s\n' "$4" ;;
    *" alpine "*) printf '%s\n' "$5" ;;
    *) printf '%s\n' "$6" ;;
    esac
}

# ---- the Rust toolchain -------------------------------------------------------------------------

# version_at_least HAVE WANT
version_at_least() {
    [ "$(printf '%s\n%s\n' "$2" "$1" | sort -V | head -n 1)" = "$2" ]
}

# Finds cargo, or says how to get it; checks its version against Cargo.toml, and that something
# links.
ensure_rust() {
    local wanted have
    # rustup's folder is on the PATH only after a new login.
    if ! command -v cargo >/dev/null 2>&1 && [ -x "${CARGO_HOME:-${HOME:-}/.cargo}/bin/cargo" ]; then
        PATH="${CARGO_HOME:-$HOME/.cargo}/bin:$PATH"
        export PATH
    fi
    wanted=$(sed -n 's/^rust-version *= *"\(.*\)"/\1/p' "$root/Cargo.toml")
    if ! command -v cargo >/dev/null 2>&1 || ! command -v rustc >/dev/null 2>&1; then
        die 2 "Rust is missing (cargo and rustc $wanted or newer). To install it, type:" \
            $'\n'"  curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh -s -- -y"
    fi
    have=$({ rustc --version 2>/dev/null || true; } | sed -n 's/^rustc \([0-9.]*\).*/\1/p')
    if [ -z "$have" ] || ! version_at_least "$have" "$wanted"; then
        die 2 "Rust ${have:-of unknown version} is too old: $wanted or newer is needed. To update it, type:" \
            $'\n'"  rustup update stable"
    fi
    if ! command -v cc >/dev/null 2>&1; then
        die 2 "A C linker (cc), which Rust uses to link, is missing. To install it, type:" \
            $'\n'"  $(by_system 'sudo apt-get install gcc libc6-dev' 'sudo dnf install gcc' \
                'sudo pacman -S gcc' 'sudo zypper install gcc' 'sudo apk add gcc musl-dev' \
                '(install a C compiler)')"
    fi
}

# Builds the release program and sets $program to its path.
build_release() {
    if [ -x "${CARGO_TARGET_DIR:-$root/target}/release/raystone" ]; then
        say "Building Raystone: at most the parts that changed."
    else
        say "Building Raystone: the first time takes some minutes (about five on two cores)."
    fi
    cargo build --release --locked --manifest-path "$root/Cargo.toml"
    program=${CARGO_TARGET_DIR:-${prefix}target}/release/raystone
    # A bare relative path would be looked up on the PATH.
    case $program in */*) ;; *) program=./$program ;; esac
}

# ---- the GPU driver -----------------------------------------------------------------------------

# has_library NAME: whether the loader would find a shared library.
has_library() {
    local folder
    if PATH="$PATH:/sbin:/usr/sbin" ldconfig -p 2>/dev/null | grep -F "$1" >/dev/null; then
        return 0
    fi
    # Systems without glibc's cache, and libraries named by the environment.
    local IFS=:
    for folder in ${LD_LIBRARY_PATH:-} /usr/lib /usr/local/lib /lib /usr/lib64; do
        [ -n "$folder" ] && [ -e "$folder/$1" ] && return 0
    done
    return 1
}

# has_icd FILE_OR_FOLDER: whether it describes a Vulkan driver whose library exists.
has_icd() {
    local file library
    for file in "$1" "$1"/*.json; do
        [ -f "$file" ] || continue
        library=$(sed -n '/"library_path"/{s/.*"library_path"[^"]*"\([^"]*\)".*/\1/p;q;}' "$file")
        case $library in
        "") continue ;;
        /*) [ -e "$library" ] && return 0 ;;
        */*) [ -e "$(dirname "$file")/$library" ] && return 0 ;;
        *) has_library "$library" && return 0 ;;
        esac
    done
    return 1
}

has_vulkan() {
    local place places
    has_library libvulkan.so.1 || return 1
    # As the Vulkan loader does: a list of drivers in the environment replaces the system's.
    places=${VK_DRIVER_FILES:-${VK_ICD_FILENAMES:-${RAYSTONE_ICD_DIRS:-}}}
    if [ -z "$places" ]; then
        places=/usr/share/vulkan/icd.d:/usr/local/share/vulkan/icd.d:/etc/vulkan/icd.d
        places=$places:${XDG_DATA_HOME:-${HOME:-}/.local/share}/vulkan/icd.d
        places=$places:/run/opengl-driver/share/vulkan/icd.d
    fi
    local IFS=:
    for place in $places; do
        has_icd "$place" && return 0
    done
    return 1
}

# Says what to type where Debian 12's own software driver would be used, which is slow and ends the loops
# of kernels early.
recommend_driver() {
    local version
    [ -z "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}${WGPU_BACKEND:-}" ] || return 0
    [ "$(os_field ID) $(os_field VERSION_ID)" = "debian 12" ] || return 0
    version=$(dpkg-query -W -f='${Version}' mesa-vulkan-drivers 2>/dev/null) || return 0
    case $version in
    22.*) say "Mesa $version, Debian 12's own software driver, ends loops early and takes twice as long or more. For a better one, type:" \
        $'\n'"  scripts/install-driver --backports" ;;
    esac
}

# Sees to a driver that wgpu can use: what is there, else the software driver if it may be
# installed, else GL; else says what to type and exits with 3.
ensure_driver() {
    [ "$(uname -s)" = Linux ] || return 0 # Metal and DirectX come with the system
    if [ -n "${WGPU_BACKEND:-}" ]; then
        say "WGPU_BACKEND=$WGPU_BACKEND is set: not looking for another driver."
        return 0
    fi
    if has_vulkan; then return 0; fi
    if [ "${RAYSTONE_NO_INSTALL:-0}" != 1 ] && is_debian_like && can_be_root; then
        say "No Vulkan driver found: installing the software driver."
        if "$root/scripts/install-driver" && has_vulkan; then return 0; fi
        say "That gave no Vulkan driver."
    fi
    if has_library libEGL.so.1; then
        say "No Vulkan driver found: using OpenGL (WGPU_BACKEND=gl)."
        export WGPU_BACKEND=gl
        return 0
    fi
    die 3 "No GPU driver found, neither Vulkan nor OpenGL. For one that runs on any processor, type:" \
        $'\n'"  $(by_system \
            'sudo apt-get install --no-install-recommends mesa-vulkan-drivers libvulkan1' \
            'sudo dnf install mesa-vulkan-drivers vulkan-loader' \
            'sudo pacman -S vulkan-swrast vulkan-icd-loader' \
            'sudo zypper install libvulkan_lvp libvulkan1' \
            'sudo apk add mesa-vulkan-swrast vulkan-loader' \
            "(install Mesa's software Vulkan driver, lavapipe, and the Vulkan loader)")"
}
