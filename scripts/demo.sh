#!/bin/sh
# The sample materials as pictures, tables, values and rendered scenes, in one folder with a page that shows them.
#
# usage: scripts/demo.sh BISCALE FOLDER [SHOOT_FOLDER]     with photographs to capture
set -eu
biscale=$1
folder=$2
shoot=${3:-}
mkdir -p "$folder"

# Relative RMS error of the plots, of the baked table and of the rendered pictures. The program's own default, .005, is for use; these are for looking at.
plot_tolerance=0.01
bake_tolerance=0.02
render_tolerance=0.03

page="$folder/index.html"
part="$page.part"
trap 'rm -f "$part"' EXIT
cat >"$part" <<'HTML'
<!doctype html>
<html lang="en">
<meta charset="utf-8">
<title>biscale: effective BRDFs of the samples</title>
<style>
body { font: 16px/1.5 sans-serif; max-width: 76rem; margin: 2rem auto; padding: 0 1rem; color: #222 }
img { max-width: 100%; height: auto } .view { width: 34% } .polar { width: 64% } .scene { width: 24% }
h2 { font-size: 1.1rem; margin: 2.5rem 0 0 } p { margin: .2rem 0 .6rem } code { background: #f2f2f2; padding: 0 .3em }
</style>
<h1>Effective BRDFs of the samples</h1>
<p>Left: the small-scale surface. Right: how it reflects from afar, in slices: light at three angles, viewers in the
plane of incidence and across it. Each picture can be made again by the command above it.</p>
HTML

# plain TEXT: TEXT with the letters that mean something in HTML escaped, and without backticks; html TEXT: with code in the place of backticks
plain() { printf '%s' "$1" | sed 's/&/\&amp;/g; s/</\&lt;/g; s/>/\&gt;/g; s/"/\&quot;/g; s/`//g'; }
html() { printf '%s' "$1" | sed 's/&/\&amp;/g; s/</\&lt;/g; s/>/\&gt;/g; s/`\([^`]*\)`/<code>\1<\/code>/g'; }

for material in samples/*.toml; do
    name=$(basename "$material" .toml)
    # The first line of a sample says what it is.
    what=$(sed -n '1s/^# *//p' "$material")
    echo "--- $name: $what"
    "$biscale" plot "$material" -o "$folder" --tolerance $plot_tolerance
    cat >>"$part" <<HTML
<h2>$(html "$what")</h2>
<p><code>biscale plot samples/$name.toml -o demo --tolerance $plot_tolerance</code></p>
<a href="$name-view.svg"><img class="view" src="$name-view.png" alt="the surface"></a>
<a href="$name-polar.svg"><img class="polar" src="$name-polar.png" alt="polar plots"></a>
HTML
done

echo "--- A whole effective BRDF as a table, values out of it, and its plots"
table=grooves-two-hue-table
"$biscale" bake samples/grooves-two-hue.toml -o "$folder/$table.exr" --tolerance $bake_tolerance
"$biscale" eval "$folder/$table.exr" --pairs samples/slice.csv -o "$folder/slice.csv"
"$biscale" plot samples/grooves-two-hue.toml "$folder/$table.exr" -o "$folder" --tolerance $plot_tolerance
cat >>"$part" <<HTML
<h2>A whole effective BRDF as a table</h2>
<p><code>biscale bake samples/grooves-two-hue.toml -o demo/$table.exr --tolerance $bake_tolerance</code>, then
<code>biscale eval demo/$table.exr --pairs samples/slice.csv -o demo/slice.csv</code>, and both in one plot,
<code>biscale plot samples/grooves-two-hue.toml demo/$table.exr -o demo</code>: dashed is what the table interpolates between its directions, which are
farthest apart from what is exact near the horizon.</p>
<img class="polar" src="grooves-two-hue-and-$table-polar.png" alt="polar plots of the surface and of the table">
<h2>From afar</h2>
<p>Objects whose surface is such a material: <code>biscale render samples/scenes/NAME.toml -o demo/NAME.png --tolerance $render_tolerance</code></p>
HTML
for scene in samples/scenes/*.toml; do
    name=$(basename "$scene" .toml)
    what=$(sed -n '1s/^# *//p' "$scene")
    echo "--- $name: $what"
    "$biscale" render "$scene" -o "$folder/$name.png" --tolerance $render_tolerance
    echo "<img class=\"scene\" src=\"$name.png\" alt=\"$name\" title=\"$(plain "$what")\">" >>"$part"
done
if [ -n "$shoot" ]; then
    echo "--- A made-up shoot captured"
    "$biscale" capture "$shoot/shoot.toml" -o "$folder/captured"
    cat >>"$part" <<'HTML'
<h2>Photographs in, measurements out</h2>
<p>A made-up shoot of a twill on a board: <code>biscale capture target/demo-shoot/shoot.toml -o demo/captured</code> wrote <a href="captured/report.html">this report</a>.</p>
HTML
fi
echo '</html>' >>"$part"
mv "$part" "$page"
echo "--- done: open $(cd "$folder" && pwd)/index.html"
