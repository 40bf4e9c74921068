#!/bin/sh
# The pictures of docs/iwasaki-2012.md after Figures 3, 4, 6 and 9, and on standard output the differences that stand there.
#
# usage: scripts/make_iwasaki_figures.sh BISCALE FOLDER     FOLDER is usually docs/gallery
set -eu
biscale=$1
folder=$2
mkdir -p "$folder"
work=$(mktemp -d)
trap 'rm -r "$work"' EXIT

glossy() { # OUTPUT MATERIAL ARGUMENTS...: the glossy vase
    output=$1
    material=$2
    shift 2
    "$biscale" render samples/scenes/glossy.toml --material "samples/figures/$material.toml" -o "$output" --force --quiet --tolerance 0.02 "$@"
}

panels() { # REFERENCE JUDGED NAME: both and their difference side by side, and the PSNR
    printf '%s: ' "$3"
    "$biscale" compare "$1" "$2" -o "$folder/$3.png" --force --color never
}

for f in 3a 3b 3c; do glossy "$folder/iwasaki$f.png" iwasaki$f --method direct; done

glossy "$work/4.png" iwasaki4 --method direct
for lobes in 1 4 8; do
    glossy "$work/4-$lobes.png" iwasaki4 --plan "sg:paper:lobes=$lobes"
    panels "$work/4.png" "$work/4-$lobes.png" "iwasaki4-$lobes"
done

for f in 6a 6b 6c; do
    "$biscale" render samples/scenes/pillow.toml --material "samples/figures/iwasaki$f.toml" -o "$folder/iwasaki$f.png" --force --quiet \
        --tolerance 0.05 --exposure=-2.5
done

# The shares of power with which `M` keeps 70 (bronze: 68) and 120 vectors on these maps.
figure9() { # NAME MATERIAL EXPOSURE ENERGY_OF_70 ENERGY_OF_120
    glossy "$work/$1.png" "$2" --exposure="$3" --method direct
    glossy "$work/$1-70.png" "$2" --exposure="$3" --plan "lowrank:paper:rates=24x32:energy=0.995,$4"
    glossy "$work/$1-120.png" "$2" --exposure="$3" --plan "lowrank:paper:rates=24x32:energy=0.995,$5"
    glossy "$work/$1-sg.png" "$2" --exposure="$3" --method sg
    for of in 70 120 sg; do panels "$work/$1.png" "$work/$1-$of.png" "$1-$of"; done
}
figure9 iwasaki9a iwasaki3b -4 0.2133 0.3755
figure9 iwasaki9b iwasaki9b -1 0.386 0.581
