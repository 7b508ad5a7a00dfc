#!/usr/bin/env bash
# Builds the image of deploy/Containerfile with Debian's buildah and runs it on a folder of drives: as its user, on a read-only root file
# system, the folder as /data.
#   scripts/check_container.sh target/release/motorcade DATA      DATA: a manifest drives.csv and what it names, writable by user 10001
# No registry is asked: the base image is made here by debootstrap, and the given program stands for what the stage `build` copies out
# (scripts/check_deploy.sh runs that stage's command with STATIC=1). Exit code 77 where this machine cannot do it.
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "$1")
data=$(realpath "$2")
cannot() { echo "no container here: $*"; exit 77; }
expect() { [ "$2" = "$3" ] || { echo "$1: expected \`$3\`, found \`$2\`"; exit 1; }; }
[ "$(id -u)" = 0 ] && unshare -m true 2>/dev/null || cannot "not root, or no right to mount"
missing=()
for tool in buildah debootstrap; do command -v "$tool" >/dev/null || missing+=("$tool"); done
if [ ${#missing[@]} -gt 0 ]; then
    (apt-get update -q && apt-get install -qy --no-install-recommends "${missing[@]}") >/dev/null 2>&1 ||
        cannot "${missing[*]} could not be installed"
fi

folder=$(mktemp -d)
# Images of its own place, which goes away with it; no overlay file system and no further program to run containers are needed.
export STORAGE_DRIVER=vfs BUILDAH_ISOLATION=chroot
buildah() { command buildah --root "$folder/images" --runroot "$folder/run" "$@"; }
trap 'buildah rm -a >/dev/null 2>&1 || true; rm -rf "$folder"' EXIT
debootstrap --variant=minbase stable "$folder/debian" >"$folder/debootstrap.log" 2>&1 || cannot "debootstrap: $(tail -1 "$folder/debootstrap.log")"
base=$(buildah from scratch)
buildah add -q "$base" "$folder/debian" / >/dev/null
buildah commit -q "$base" debian:stable-slim >/dev/null
rm -rf "$folder/debian"

mkdir "$folder/build" "$folder/empty"
cp "$program" "$folder/build/motorcade"
chmod 755 "$folder/build/motorcade"
buildah bud -q --pull-never --build-context build="$folder/build" -f deploy/Containerfile -t motorcade-check "$folder/empty" >"$folder/build.log" 2>&1 ||
    { tail -20 "$folder/build.log"; exit 1; }
container=$(buildah from --pull-never motorcade-check)
of() { buildah inspect --format "{{.OCIv1.Config.$1}}" "$container"; }
expect "user" "$(of User)" 10001:10001
expect "entry point" "$(of Entrypoint)" "[motorcade]"
expect "directory" "$(of WorkingDir)" /data
expect "volume" "$(of Volumes)" "map[/data:{}]"

root=$(buildah mount "$container")
cat >"$folder/inside.sh" <<'INSIDE'
set -eu
mount --make-rprivate /
mount --bind "$1" "$1"
mount --bind "$2" "$1/data"
mount -t proc proc "$1/proc"
mount -t tmpfs tmpfs "$1/tmp"
mount -o remount,bind,ro "$1"
exec chroot "$1" setpriv --reuid=10001 --regid=10001 --clear-groups --no-new-privs --bounding-set=-all \
    env -i PATH=/usr/local/bin:/usr/bin:/bin MOTORCADE_MODELS=none sh -c 'cd /data
        if touch /written-by-check 2>/dev/null; then echo "the root file system can be written"; exit 1; fi
        ffmpeg -version >/dev/null
        exec motorcade batch drives.csv --out fleet --jobs 2 --progress plain'
INSIDE
unshare -m bash "$folder/inside.sh" "$root" "$data" >/dev/null 2>"$folder/inside.log" || { cat "$folder/inside.log"; exit 1; }
echo "container: built by $(buildah --version | cut -d' ' -f1-3), $(du -sm "$root" | cut -f1) MB, run as user 10001 on a read-only root file system"
