#!/usr/bin/env bash
# Makes docs/demo.webp, the animation of the README, from the overlay of the demo: a rendered drive, estimated by the program.
#   cargo run --release -- demo && scripts/readme_animation.sh runs/demo
# Needs ffmpeg with libwebp.
set -euo pipefail
cd "$(dirname "$0")/.."
run=${1:-runs/demo}
most=3000000
ffmpeg -v error -y -i "$run/overlay.mp4" -vf 'fps=10,scale=1080:-2:flags=lanczos' -c:v libwebp_anim -quality 55 -compression_level 6 -loop 0 -an docs/demo.webp
size=$(stat -c %s docs/demo.webp)
echo "docs/demo.webp: $size bytes"
[ "$size" -le "$most" ] || { echo "over $most bytes" >&2; exit 1; }
