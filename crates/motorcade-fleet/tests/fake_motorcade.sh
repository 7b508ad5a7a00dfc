#!/bin/sh
# Stands in for the program: the input is a piece of shell, which finds the directory of the results in $out.
shift
out= replace=no
while [ "$1" != -- ]; do
  case $1 in
    --out) out=$2; shift ;;
    --force) replace=yes ;;
    --threads) threads=$2; shift ;;
  esac
  shift
done
input=$2
echo "$replace" >>"$input.calls"
attempt=$(wc -l <"$input.calls" | tr -d ' ')
# results FINGERPRINT: what a finished run leaves.
results() {
  mkdir -p "$out"
  echo "{\"fingerprint\":\"$1\",\"interrupted\":false,\"length_m\":12.5,\"input\":{\"duration_s\":2.0},\"counters\":{\"frames\":20,\"vehicles\":1},\"warnings\":[\"a warning\"]}" >"$out/run.json"
}
. "$input"
