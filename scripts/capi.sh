#!/usr/bin/env bash
# Builds the library for C and C++ and installs it, with its header, a CMake package and a pkg-config file:
#
#     scripts/capi.sh DIR [--lean] [--no-zstd] [--quick]
#
# DIR/include/sateen.h, DIR/lib/libsateen.a, libsateen.so, cmake/sateen/, pkgconfig/sateen.pc. --lean leaves Rust's standard library out: a
# third of the bytes, static alone. --no-zstd leaves the decoder out, for tables written by `sateen bake --stored` alone. --quick builds it as
# fast as can be, to test it.
set -euo pipefail
prefix=${1:?usage: scripts/capi.sh DIR [--lean] [--no-zstd] [--quick]}
shift
features=ffi,std
zstd=,zstd
profile=capi
types=staticlib,cdylib
flags=
for option in "$@"; do
    case $option in
    --lean)
        features=ffi,libm,small
        types=staticlib
        # The allocator and the end of a panic, of which a program may have one each.
        flags="--cfg sateen_runtime"
        export CARGO_PROFILE_CAPI_OPT_LEVEL=s CARGO_PROFILE_DEV_PANIC=abort
        ;;
    --no-zstd) zstd= ;;
    --quick) profile=dev ;;
    *)
        echo "capi.sh: unknown option $option" >&2
        exit 2
        ;;
    esac
done
mkdir -p "$prefix"
prefix=$(realpath "$prefix")
cd "$(dirname "$0")/.."
target=${CARGO_TARGET_DIR:-target}
folder=$target/$profile
if [ "$profile" = dev ]; then
    folder=$target/debug
    # Not 0: vector code that is inlined and not optimized has megabytes of variables.
    export CARGO_PROFILE_DEV_OPT_LEVEL=1 CARGO_PROFILE_DEV_DEBUG=false
fi
# shellcheck disable=SC2086
cargo rustc --locked --quiet --lib --profile "$profile" --no-default-features --features "$features$zstd" \
    --crate-type "$types" -- $flags
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)

mkdir -p "$prefix/include" "$prefix/lib/cmake/sateen" "$prefix/lib/pkgconfig"
cp src/ffi/sateen.h "$prefix/include/"
cp "$folder"/libsateen.a "$prefix/lib/"
rm -f "$prefix"/lib/libsateen.so "$prefix"/lib/libsateen.dylib
for shared in "$folder"/libsateen.so "$folder"/libsateen.dylib; do
    if [[ $types == *cdylib* && -e $shared ]]; then
        cp "$shared" "$prefix/lib/"
    fi
done
cat >"$prefix/lib/pkgconfig/sateen.pc" <<PC
prefix=\${pcfiledir}/../..
Name: sateen
Description: Fabric BRDFs from tables
Version: $version
Cflags: -I\${prefix}/include
Libs: -L\${prefix}/lib -lsateen
Libs.private: -lm -lpthread -ldl
PC
cat >"$prefix/lib/cmake/sateen/sateenConfig.cmake" <<'CMAKE'
# sateen::sateen, the static library, and sateen::shared.
get_filename_component(_sateen "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
find_package(Threads REQUIRED)
if(NOT TARGET sateen::sateen)
    add_library(sateen::sateen STATIC IMPORTED)
    set_target_properties(sateen::sateen PROPERTIES
        IMPORTED_LOCATION "${_sateen}/lib/libsateen.a"
        INTERFACE_INCLUDE_DIRECTORIES "${_sateen}/include"
        INTERFACE_LINK_LIBRARIES "Threads::Threads;m;${CMAKE_DL_LIBS}")
    add_library(sateen::shared SHARED IMPORTED)
    set_target_properties(sateen::shared PROPERTIES
        IMPORTED_LOCATION "${_sateen}/lib/libsateen${CMAKE_SHARED_LIBRARY_SUFFIX}"
        IMPORTED_NO_SONAME ON
        INTERFACE_INCLUDE_DIRECTORIES "${_sateen}/include")
endif()
CMAKE
cat >"$prefix/lib/cmake/sateen/sateenConfigVersion.cmake" <<CMAKE
set(PACKAGE_VERSION "$version")
if(PACKAGE_FIND_VERSION VERSION_LESS_EQUAL PACKAGE_VERSION)
    set(PACKAGE_VERSION_COMPATIBLE TRUE)
endif()
CMAKE
