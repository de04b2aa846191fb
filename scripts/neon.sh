#!/usr/bin/env bash
# Builds the core for 64-bit ARM and runs it under QEMU: tests/core.rs, with and without the standard library, and a comparison of
# values of the golden tables with those of this machine (scripts/neon.rs).
#
#     scripts/neon.sh
#
# It takes Debian or what is made of it, and some minutes. What is missing is installed:
#
# - gcc-aarch64-linux-gnu, libc6-dev-arm64-cross and qemu-user, by apt;
# - Rust's library for aarch64-unknown-linux-gnu, unless `rustup target add aarch64-unknown-linux-gnu` has: its source, in the compiler's
#   version, from Debian's package rust-src. It is unpacked in target/neon and built with the core.
#
# On an ARM machine `cargo test` does it all.
set -euo pipefail
cd "$(dirname "$0")/.."
target=aarch64-unknown-linux-gnu
home=$(realpath -m "${CARGO_TARGET_DIR:-target}")/neon
mkdir -p "$home"

packages=()
command -v aarch64-linux-gnu-gcc >/dev/null || packages+=(gcc-aarch64-linux-gnu)
[[ -e /usr/aarch64-linux-gnu/include/stdio.h ]] || packages+=(libc6-dev-arm64-cross)
command -v qemu-aarch64 >/dev/null || packages+=(qemu-user)
if ((${#packages[@]})); then
    echo "neon.sh: installing ${packages[*]}"
    as_root=()
    ((EUID == 0)) || as_root=(sudo)
    "${as_root[@]}" apt-get update --quiet=2
    "${as_root[@]}" apt-get install --quiet=2 --yes --no-install-recommends "${packages[@]}" >/dev/null
fi
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="qemu-aarch64 -L /usr/aarch64-linux-gnu"
export CC_aarch64_unknown_linux_gnu=aarch64-linux-gnu-gcc

# The source of Rust's library in version $1, as Debian packs it: prints where it is.
source_of() {
    local root=$home/rust-$1 version
    if [[ ! -d $root/usr/src/rustc-$1/library ]]; then
        echo "neon.sh: unpacking rust-src $1 in $root" >&2
        local apt=$home/apt
        mkdir -p "$apt"/{lists,cache}/partial "$apt/cache/archives/partial"
        touch "$apt/status"
        for suite in trixie-backports sid; do
            echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] http://deb.debian.org/debian $suite main"
        done >"$apt/sources.list"
        # Lists of its own: this machine's are left as they are.
        cat >"$apt/apt.conf" <<CONF
Dir::State "$apt";
Dir::State::lists "$apt/lists";
Dir::State::status "$apt/status";
Dir::Cache "$apt/cache";
Dir::Etc::sourcelist "$apt/sources.list";
Dir::Etc::sourceparts "-";
APT::Sandbox::User "$(id -un)";
Acquire::Languages "none";
CONF
        export APT_CONFIG=$apt/apt.conf
        apt-get update --quiet=2 >&2
        version=$(apt-cache madison rust-src | awk -v wanted="$1" '$3 ~ "^" wanted "[+~-]" { print $3; exit }')
        if [[ -z $version ]]; then
            echo "neon.sh: Debian has no rust-src $1, but these: $(apt-cache madison rust-src | awk '{ printf "%s ", $3 }')" >&2
            return 1
        fi
        (cd "$home" && apt-get download --quiet=2 "rust-src=$version" && dpkg -x rust-src_*.deb "$root" && rm rust-src_*.deb) >&2
        unset APT_CONFIG
    fi
    echo "$root/usr/src/rustc-$1/library"
}

flags=(--target "$target")
if [[ -d $(rustc --print sysroot)/lib/rustlib/$target ]]; then
    echo "neon.sh: Rust's library for $target is there"
else
    source=$(source_of "$(rustc -vV | sed -n 's/^release: //p')")
    echo "neon.sh: Rust's library for $target is built from $source"
    # Cargo asks for the source beside the compiler, but for this; and stable compilers build no library, but for that.
    export __CARGO_TESTS_ONLY_SRC_ROOT=$source RUSTC_BOOTSTRAP=1
    flags+=(-Z build-std)
fi

failed=0
# As of scripts/check.sh: all tests, since none at all would pass, too.
count=$(grep -c '^#\[test\]' tests/core.rs)
for features in std,zstd libm,small; do
    echo "neon.sh: tests/core.rs with $features"
    CARGO_TARGET_DIR=$home scripts/core.sh test --lib --features "$features" "${flags[@]}" | tee "$home/tests" || failed=1
    grep -q "ok. $count passed" "$home/tests" || failed=1
done

echo "neon.sh: values of golden tables here and there"
root=$PWD
package=$home/values
mkdir -p "$package"
cat >"$package/Cargo.toml" <<MANIFEST
[package]
name = "neon"
edition = "2024"

[[bin]]
name = "neon"
path = "$root/scripts/neon.rs"

[dependencies]
sateen = { path = "$root", default-features = false, features = ["std", "zstd"] }

[workspace]
MANIFEST
cp Cargo.lock "$package/"
cd "$package"
export CARGO_TARGET_DIR=$package
tables=("$root"/tests/data/tables/*.sateen)
env -u RUSTC_BOOTSTRAP cargo run --quiet --release -- write "${tables[@]}" >"$package/here"
cargo run --quiet --release "${flags[@]}" -- compare "$package/here" "${tables[@]}" || failed=1
if ((failed)); then
    echo "neon.sh: failed" >&2
    exit 1
fi
