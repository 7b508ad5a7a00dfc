#!/usr/bin/env bash
# Builds deploy/Containerfile with Debian's buildah, as it is, from what deploy/static.sh built, and runs the image on a folder of drives: as
# its user, on a read-only root file system, the folder as /data. Then the same on the base with ffmpeg (deploy/ffmpeg.Containerfile); no
# registry is asked: its own base is made here by debootstrap.
#   scripts/check_container.sh DATA      DATA: a manifest drives.csv and what it names, writable by user 10001
# Exit code 77 where this machine cannot do it.
set -euo pipefail
cd "$(dirname "$0")/.."
data=$(realpath "$1")
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

# In a container: the root file system read-only, with what every runtime adds (/dev, /proc), /data and /tmp; then the image's own entry point as its own user.
cat >"$folder/inside.sh" <<'INSIDE'
set -eu
root=$1 data=$2
shift 2
mount --make-rprivate /
mount --bind "$root" "$root"
mkdir -p "$root/dev" "$root/proc" "$root/tmp"
mount --bind "$data" "$root/data"
mount -t tmpfs -o mode=755 tmpfs "$root/dev"
for device in null zero full random urandom; do
    touch "$root/dev/$device"
    mount --bind "/dev/$device" "$root/dev/$device"
done
mount -t proc proc "$root/proc"
mount -t tmpfs -o mode=1777 tmpfs "$root/tmp"
mount -o remount,bind,ro "$root"
if touch "$root/written-by-check" 2>/dev/null; then echo "the root file system can be written"; exit 1; fi
# `chroot` starts in /.
within() { env -i PATH=/usr/local/bin:/usr/bin:/bin MOTORCADE_MODELS=none setpriv --no-new-privs /usr/sbin/chroot --userspec=10001:10001 --groups= "$root" "$@"; }
[ ! -e "$root/usr/bin/ffmpeg" ] || within /usr/bin/ffmpeg -version
within "$@" batch /data/drives.csv --out /data/fleet --jobs 2 --progress plain
INSIDE

# Builds the image on a base and works through the drives in it.
image() {
    local container root user
    buildah bud -q --pull-never "${@:2}" -f deploy/Containerfile -t motorcade-check target/container >"$folder/build.log" 2>&1 ||
        { tail -20 "$folder/build.log"; exit 1; }
    container=$(buildah from --pull-never motorcade-check)
    of() { buildah inspect --format "{{.OCIv1.Config.$1}}" "$container"; }
    expect "user" "$(of User)" 10001:10001
    expect "entry point" "$(of Entrypoint)" "[/usr/local/bin/motorcade]"
    expect "directory" "$(of WorkingDir)" /data
    expect "volume" "$(of Volumes)" "map[/data:{}]"
    root=$(buildah mount "$container")
    expect "owner of /data" "$(stat -c %u:%g "$root/data")" 10001:10001
    rm -rf "$data/fleet"
    unshare -m bash "$folder/inside.sh" "$root" "$data" /usr/local/bin/motorcade >/dev/null 2>"$folder/inside.log" ||
        { cat "$folder/inside.log"; exit 1; }
    expect "drives" "$(tail -n +2 "$data/fleet/manifest.done.csv" | cut -d, -f2 | sort | uniq -c | tr -s ' ' | tr '\n' ' ')" " 3 done "
    expect "owner" "$(stat -c %u "$data/fleet/manifest.done.csv")" 10001
    echo "container $1: built by $(buildah --version | cut -d' ' -f1-3), $(du -sm "$root" | cut -f1) MB, run as user 10001 on a read-only root file system"
}

image "on an empty base"
debootstrap --variant=minbase stable "$folder/debian" >"$folder/debootstrap.log" 2>&1 || cannot "debootstrap: $(tail -1 "$folder/debootstrap.log")"
base=$(buildah from scratch)
buildah add -q "$base" "$folder/debian" / >/dev/null
buildah commit -q "$base" debian:stable-slim >/dev/null
rm -rf "$folder/debian"
mkdir "$folder/empty"
buildah bud -q --pull-never -f deploy/ffmpeg.Containerfile -t motorcade-base "$folder/empty" >"$folder/base.log" 2>&1 ||
    { tail -20 "$folder/base.log"; exit 1; }
image "with ffmpeg" --build-arg BASE=localhost/motorcade-base
