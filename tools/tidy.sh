#!/usr/bin/env bash
# clang-tidy over the libraries, the program, the Python module and the benchmarks (not over tests). A source that was found clean is not looked at again as long as nothing
# that it includes, the rules and clang-tidy itself have changed: a stamp of all that lies in the user's cache, so that
# other clones find it, too.
# --all: over everything; --lately: only over what the last 20 commits have touched.
# usage: tidy.sh CLANG_TIDY BUILD_FOLDER JOBS [--all|--lately]
set -eu
cd "$(dirname "$0")/.."
export tidy=$1 build=$2
jobs=$3
export all=${4:-}
lately=""
[ "$all" != --lately ] || { all="" lately=$(git log -20 --format= --name-only | sort -u); }
export stamps=${XDG_CACHE_HOME:-$HOME/.cache}/pointflight/tidy
mkdir -p "$stamps"
find "$stamps" -type f -name '????????????????????????????????????????????????????????????????' -mtime +60 -delete
rules=$({ "$tidy" --version; cat .clang-tidy tools/tidy.sh; } | sha256sum)
export rules

# one SOURCE COMMAND: lints it, unless it is known to be clean
one() {
  local source=$1 command=$2 checks=()
  # the check that takes more than all others together in CLI11's headers
  case $source in */batches/apps_*) checks=(--checks=-performance-unnecessary-value-param) ;; esac
  local stamp
  stamp=$stamps/$({ printf '%s\n' "$rules" "${checks[*]:-}"
    (cd "$build" && eval "${command% -o *} -E -P -o -  '$source'") | sed "s|$PWD||g"; } | sha256sum | cut -c 1-64)
  [ -z "$all" ] && [ -f "$stamp" ] && return
  "$tidy" -p "$build" --quiet "${checks[@]}" "$source" 2>/dev/null || return 255
  : >"$stamp"
}
export -f one

python3 - "$build" "$lately" <<'END' | xargs -0 -P "$jobs" -n 2 bash -c 'one "$1" "$2"' one
import json, re, sys
lately = tuple(name[:-4] for name in sys.argv[2].split() if name.endswith((".cpp", ".hpp")))
def is_touched(path):
    """True of a source if it or its own header is among them, of a batch if one of its sources is."""
    parts = re.findall(r'#include "([^"]+)"', open(path).read()) if "/batches/" in path else [path]
    return any(part[:-4].endswith(lately) for part in parts)
seen = 0
for entry in json.load(open(sys.argv[1] + "/compile_commands.json")):
    if re.search(r"/batches/(?!tests_)|/(pointflight|bench|python)/[a-z0-9_/]+\.cpp$", entry["file"]):
        seen += 1
        if lately and not is_touched(entry["file"]):
            continue
        print(entry["file"], entry["command"], sep="\0", end="\0")
sys.exit(0 if seen else "nothing to lint")
END
