#!/bin/sh
# Fig. 10 of Wu et al. 2011, by a program: a photograph from afar and one from near, a material, and that material on another object in new light.
# usage: scripts/fit_figure.sh BISCALE FOLDER     FOLDER/pictures.png and pillow.png are fit-pictures.png and fit-pillow.png of docs/gallery
set -eu
biscale=$1
folder=$2
"$biscale" fit samples/fit/fit.toml -o "$folder"
"$biscale" render samples/scenes/pillow.toml --material "$folder/material.toml" -o "$folder/pillow.png" --tolerance 0.02 --exposure -1.8 --force
