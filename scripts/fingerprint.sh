#!/bin/sh
# What the program answers, as one list of checksums: two builds that compute the same print the same list.
# Run it before and after a change of structure, and compare: diff BEFORE/SUMS AFTER/SUMS.
#
# usage: scripts/fingerprint.sh BISCALE FOLDER [quick]     "quick": without pictures and fits (about 1 CPU minute)
#        TRUTH=FOLDER: also the material files and pairs of the truth cases there
set -eu
biscale=$1
folder=$2
quick=${3:-}
mkdir -p "$folder"
sums=$folder/SUMS
: >"$sums"

# sum NAME: adds the checksum of a file of the folder to the list, without the lines that tell times
sum() {
    printf '%s %s\n' "$(grep -av -e millisecond -e seconds -e '"time' "$folder/$1" | sha256sum | cut -c1-16)" "$1" >>"$sums"
}

# Effective values, by each method.
values() { # NAME MATERIAL PAIRS OPTIONS...
    of=$1 from=$2 pairs=$3
    shift 3
    "$biscale" eval "$from" --pairs "$pairs" -o "$folder/$of.csv" --force --quiet "$@" && sum "$of.csv"
}
for material in samples/*.toml samples/figures/*.toml; do
    values "eval-$(basename "$material" .toml)" "$material" samples/slice.csv --tolerance 0.02
done
if [ -n "${TRUTH:-}" ]; then
    for material in "$TRUTH"/*.toml; do
        name=$(basename "$material" .toml)
        values "truth-$name" "$material" "$TRUTH/${name%%.*}.pairs.csv"
    done
fi
for material in grooves-two-hue pyramids shot-silk; do
    values "reference-$material" samples/$material.toml samples/slice.csv --method reference --tolerance 0.05
    values "bounces-$material" samples/$material.toml samples/slice.csv --bounces 3 --tolerance 0.05
    values "lowrank-$material" samples/$material.toml samples/slice.csv --method lowrank --tolerance 0.1
    values "improved-$material" samples/$material.toml samples/slice.csv --method lowrank --variant improved --tolerance 0.1
done

# A table, patterns, plots.
"$biscale" bake samples/grooves-two-hue.toml -o "$folder/table.exr" --tolerance 0.05 --force --quiet
values table "$folder/table.exr" samples/slice.csv
fold() { # NAME.ENDING ARGUMENTS...
    name=$1
    shift
    "$biscale" fold "$@" -o "$folder/$name" --force --quiet
    for file in "$folder/${name%.*}"*."${name##*.}"; do sum "$(basename "$file")"; done
}
fold pyramids.svg samples/pyramids.toml --scale 400 --periods 6x4
fold pyramids.fold samples/pyramids.toml --scale 400 --periods 6x4
fold grooves.svg samples/grooves-two-hue.toml --scale 2 --periods 12x12
fold silk.svg samples/shot-silk.toml --scale 60 --periods 3x2
fold wrap.svg samples/grooves-two-hue.toml --scale 2 --on cylinder:radius=30,height=100 --paper-thickness 0.1
fold pyramids.dxf samples/pyramids.toml --scale 400 --periods 3x2
"$biscale" plot samples/shot-silk.toml -o "$folder/plot" --tolerance 0.05 --force --quiet
for file in "$folder"/plot/*.svg; do sum "plot/$(basename "$file")"; done

if [ "$quick" != quick ]; then
    for scene in samples/scenes/*.toml; do
        name=$(basename "$scene" .toml)
        "$biscale" render "$scene" -o "$folder/$name.exr" --tolerance 0.05 --force --quiet
        sum "$name.exr"
    done
    "$biscale" fit samples/fit/fit.toml -o "$folder/fit" --force --quiet || true
    sum fit/material.toml
fi
