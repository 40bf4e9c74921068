#!/bin/sh
# The effective BRDFs of the sample materials: values along a slice, polar plots with error bars, a view of each surface, and one baked
# table; all in one folder, with an index to open in a browser.
#
# usage: scripts/demo.sh BISCALE FOLDER
set -eu
biscale=$1
folder=$2
mkdir -p "$folder"
index="$folder/index.html"
{
    echo '<!doctype html><meta charset="utf-8"><title>biscale: sample materials</title>'
    echo '<style>body{font:16px sans-serif;max-width:70rem;margin:2rem auto}img{width:100%}code{background:#eee}</style>'
    echo '<h1>Sample materials</h1>'
} > "$index"
for material in samples/*.toml; do
    name=$(basename "$material" .toml)
    echo "--- $material"
    "$biscale" eval "$material" --pairs samples/slice.csv -o "$folder/$name.csv"
    "$biscale" plot "$material" -o "$folder" --quiet
    {
        echo "<h2>$name</h2>"
        echo "<p><code>biscale plot $material -o $folder</code></p>"
        echo "<img src=\"$name-view.png\" alt=\"the surface of $name\">"
        echo "<img src=\"$name-polar.png\" alt=\"polar plots of the effective BRDF of $name\">"
    } >> "$index"
done
echo "--- the whole effective BRDF of the two-hue grooves, as a table"
"$biscale" bake samples/grooves-two-hue.toml --tolerance 0.02 -o "$folder/grooves-two-hue.exr"
"$biscale" eval "$folder/grooves-two-hue.exr" --pairs samples/slice.csv -o "$folder/grooves-two-hue-table.csv"
echo
echo "Wrote values (.csv), pictures (.png, .svg) and a table (.exr) to $folder; open $index"
