#!/bin/sh
# The rendered pictures of README.md, docs/wu-2011.md and docs/iwasaki-2012.md, and the list of their errors.
#
# usage: scripts/make_gallery.sh BISCALE FOLDER     FOLDER is usually docs/gallery
set -eu
biscale=$1
folder=$2
mkdir -p "$folder"

# The program's own default, .005, is for use; this is for looking at.
tolerance=0.02

picture() { # NAME ARGUMENTS...: one picture, and what it says of itself
    name=$1
    shift
    echo "--- $name" >&2
    "$biscale" render "$@" -o "$folder/$name.png" --tolerance $tolerance --json --quiet >"$folder/$name.part"
    printf '%s: error ' "$name" >>"$folder/render.txt"
    grep -o '"relative_rms_error":[0-9.e-]*' "$folder/$name.part" | sed 's/.*://' | awk '{ printf "%s%.1f %%", (NR > 1 ? ", " : ""), 100 * $1 } END { print "" }' >>"$folder/render.txt"
    rm "$folder/$name.part"
}

trap 'rm -f "$folder"/*.part' EXIT
: >"$folder/render.txt"
for scene in ball emblem chess chess-measured; do picture $scene samples/scenes/gallery/$scene.toml; done
picture logo samples/scenes/logo.toml
figure() { picture "fig$2" "samples/scenes/gallery/$1.toml" --material "samples/figures/fig$2.toml"; }
for f in 1b 1c 1d 1e 8a 8b 8c 8d; do figure vase $f; done
for f in 4a 4b 4c; do figure cup $f; done
for f in 5a 5b 5c 5d; do figure plate $f; done
for f in 6a 6b 6c 6d; do figure skirt $f; done
for f in 7a 7b; do figure pillow $f; done
"$(dirname "$0")/make_iwasaki_figures.sh" "$biscale" "$folder"
