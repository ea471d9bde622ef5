#!/bin/sh
# A small forest for the tests of viewers. make_map.sh PROGRAM FOLDER
set -e
rm -rf "$2"
mkdir -p "$2/clients" "$2/page"
"$1" map forest --trees 60 -o "$2/forest.pcd" --force >/dev/null 2>&1
"$1" map import "$2/forest.pcd" --resolution 0.1 -o "$2/forest.pfmap" --force >/dev/null 2>&1
