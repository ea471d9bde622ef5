#!/bin/sh
# docs/scenario.md holds the table that the program prints; `./dev format` renews it.
cd "$(dirname "$0")/.." || exit 2
table=$("$1" scenario keys) || exit 2
printf '%s\n' "$table" | while IFS= read -r line; do
  grep -qxF -- "$line" docs/scenario.md || {
    echo "docs/scenario.md lacks: $line"
    echo "renew it: ./dev format"
    exit 1
  }
done
