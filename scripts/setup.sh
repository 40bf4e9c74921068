#!/bin/sh
# Everything that building needs, on a Debian-like machine: a C compiler (the linker of Rust programs) and a C++ one, a Rust toolchain, the
# crates of Cargo.lock. What is there is left alone; when all is there, nothing is asked of the network.
#
# usage: scripts/setup.sh [test|capture]     "test": also rustfmt, clippy, pdftoppm, what fabricate/validate.py uses, and OpenCV;
#                                            "capture": OpenCV, which `biscale capture` is built with
set -eu
cd "$(dirname "$0")/.."

say() { echo "setup: $*" >&2; }
fail() { say "$*"; exit 1; }

rust_needed=$(sed -n 's/^rust-version = "\([0-9.]*\)"$/\1/p' Cargo.toml)

# --- system packages ---------------------------------------------------------------------------------------------------------

install() {
    command -v apt-get >/dev/null || fail "please install: $* (there is no apt-get here)"
    as_root=
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || fail "please install as root: apt-get install $*"
        as_root=sudo
    fi
    say "installing with apt-get: $*"
    $as_root apt-get update -q >&2
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "$@" >&2
}

# A compiler without its library's headers and start files cannot link: so link. C++ is for the image comparison (FLIP).
links() {
    scratch=$(mktemp -d)
    echo 'int main(void) { return 0; }' >"$scratch/main.c"
    printf '#include <vector>\nint main() { return static_cast<int>(std::vector<int>().size()); }\n' >"$scratch/main.cpp"
    linked=0
    cc "$scratch/main.c" -o "$scratch/main" 2>/dev/null || linked=1
    c++ "$scratch/main.cpp" -o "$scratch/main" 2>/dev/null || linked=1
    rm -rf "$scratch"
    return $linked
}

if ! links; then
    say "there is no working C and C++ compiler"
    install gcc g++ libc6-dev
    links || fail "cc and c++ still cannot link a program; see the messages above"
fi

# --- the Rust toolchain: looked at, never installed -------------------------------------------------------------------------

advice="install Rust $rust_needed or newer from https://rustup.rs, or, where rustup is there, run: rustup update stable"

# at_least VERSION NEEDED, by major and minor number
at_least() {
    [ "${1%%.*}" -gt "${2%%.*}" ] && return 0
    minor=${1#*.}
    [ "${1%%.*}" -eq "${2%%.*}" ] && [ "${minor%%.*}" -ge "${2#*.}" ]
}

for tool in cargo rustc; do
    command -v $tool >/dev/null || fail "there is no $tool; $advice"
    version=$($tool --version 2>/dev/null | cut -d' ' -f2)
    case $version in
        [0-9]*.[0-9]*.*) ;;
        *) fail "$tool does not run; $advice" ;;
    esac
    at_least "$version" "$rust_needed" || fail "$tool is $version and $rust_needed is needed; $advice"
done
if [ "${1:-}" = test ]; then
    for tool in fmt clippy; do
        cargo $tool --version >/dev/null 2>&1 || fail "there is no cargo $tool; run: rustup component add rustfmt clippy"
    done
fi

# --- crates ------------------------------------------------------------------------------------------------------------------

host=$(rustc -vV | sed -n 's/^host: //p')
if ! cargo fetch --locked --offline --target "$host" >/dev/null 2>&1; then
    say "fetching the crates of Cargo.lock"
    [ -e /etc/ssl/certs/ca-certificates.crt ] || ! command -v apt-get >/dev/null || install ca-certificates
    cargo fetch --locked --target "$host" || fail "cannot fetch the crates; connect to the network once, later runs work without"
fi

# --- OpenCV with its contrib modules, and what makes its bindings ------------------------------------------------------------------

case ${1:-} in
    test | capture)
        has_opencv() {
            command -v clang >/dev/null && command -v pkg-config >/dev/null && pkg-config --exists opencv4 &&
                [ -e "$(pkg-config --variable=includedir opencv4)/opencv2/mcc.hpp" ]
        }
        has_opencv || install libopencv-dev clang libclang-dev pkg-config
        has_opencv || fail "OpenCV 4 with its contrib modules (aruco, mcc) is not there; see the messages above"
        ;;
esac

# --- what the tests of folding patterns use: a Python with the Manifold library, in a folder of its own ----------------------

if [ "${1:-}" = test ]; then
    # Pages are looked at as they would be printed.
    command -v pdftoppm >/dev/null || install poppler-utils
    venv=target/validate-venv
    wanted=fabricate/requirements.txt
    if ! cmp -s "$wanted" "$venv/installed.txt"; then
        python3 -c 'import ensurepip, venv' >/dev/null 2>&1 || install python3 python3-venv
        say "installing manifold3d into $venv"
        python3 -m venv "$venv" && "$venv/bin/python" -m pip install -q -r "$wanted" && cp "$wanted" "$venv/installed.txt" ||
            fail "cannot install $wanted; connect to the network once, later runs work without"
    fi
fi
