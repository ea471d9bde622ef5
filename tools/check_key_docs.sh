#!/bin/sh
# The pages of keys hold what the program prints; `./dev format` renews them.
# usage: check_key_docs.sh PROGRAM
cd "$(dirname "$0")/.." || exit 2
failed=0
for page in scenario:scenario lidar:sensors vehicle:vehicles; do
  command=${page%:*}
  name=${page#*:}
  table=$("$1" "$command" keys) || exit 2
  { cat "tools/${name}_doc_head.md"; printf '%s\n' "$table"; } | cmp -s - "docs/$name.md" || {
    echo "docs/$name.md is not tools/${name}_doc_head.md and '$command keys'; renew it: ./dev format"
    failed=1
  }
done
exit $failed
