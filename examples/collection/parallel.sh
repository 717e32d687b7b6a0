#!/usr/bin/env bash
# Converts a collection with GNU parallel: parallel.sh SCANS MODELS SHARDS [OPTIONS OF PARALLEL]
# With --sshloginfile hosts.txt the shards go to other machines, where both folders have the same paths.
set -euo pipefail
scans=$(realpath "$1") models=$(realpath -m "$2") shards=$3
shift 3
seq "$shards" | parallel -q --line-buffer "$@" relief batch "$scans" -o "$models" --jobs 1 --shard "{}/$shards"
