#!/bin/sh
# Makes the reference of the public headers and fails where one of their names is not documented.
# usage: check_reference.sh [FOLDER]: where html/ goes; without, nothing is kept
set -eu
cd "$(dirname "$0")/.."
command -v doxygen >/dev/null || {
  echo "check_reference: doxygen is not installed" >&2
  exit 77
}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
folder=${1:-$scratch}
mkdir -p "$folder"
python3 tools/messages.py cpp pointflight/ros/messages "$scratch/pointflight/ros/common/messages.hpp"
python3 tools/messages.py cpp pointflight/share/messages "$scratch/pointflight/share/message_structs.hpp" --namespace share_msg
{ cat tools/Doxyfile; echo "INPUT += $scratch/pointflight"; echo "OUTPUT_DIRECTORY = \"$folder\""; } | doxygen - >/dev/null 2>"$scratch/log" ||
  echo "check_reference: doxygen failed" >>"$scratch/log"
# a class passes its warnings on to those derived from it
warnings=$(sort -u "$scratch/log" | sed "s|^$PWD/||")
[ -z "$warnings" ] && [ -f "$folder/html/index.html" ] && exit 0
printf '%s\n' "$warnings" >&2
echo "check_reference: every public name has a comment of its own (CONTRIBUTING.md)" >&2
exit 1
