#!/bin/sh
# The pages of keys end with what the program prints, after a line that says so; all above it is written by hand.
# usage: check_key_docs.sh PROGRAM [--write]
cd "$(dirname "$0")/.." || exit 2
failed=0
for page in scenario:scenario lidar:sensors vehicle:vehicles study:campaigns; do
  command=${page%:*}
  name=${page#*:}
  table=$("$1" "$command" keys) || exit 2
  text=$(sed '/^<!-- keys:/q' "docs/$name.md"; printf '\n%s\n' "$table")
  [ "${2:-}" != --write ] || printf '%s\n' "$text" >"docs/$name.md"
  printf '%s\n' "$text" | cmp -s - "docs/$name.md" || {
    echo "docs/$name.md does not end with what '$command keys' prints; renew it: ./dev format"
    failed=1
  }
done
exit $failed
