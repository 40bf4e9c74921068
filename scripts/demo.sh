#!/bin/sh
# The effective BRDFs of the sample materials, along a slice: light at 30 degrees, viewer from -85 to 85.
#
# usage: scripts/demo.sh BISCALE FOLDER
set -eu
biscale=$1
folder=$2
mkdir -p "$folder"
for material in samples/*.toml; do
    name=$(basename "$material" .toml)
    echo "--- $material"
    "$biscale" check "$material"
    "$biscale" eval "$material" --pairs samples/slice.csv -o "$folder/$name.csv"
done
echo "--- wrote the values to $folder"
