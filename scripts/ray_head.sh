#!/usr/bin/env bash
# Runs a command beside the head of a Ray cluster on this machine, with its dashboard, at RAY_API_SERVER_ADDRESS. Ports are free ones.
#   scripts/ray_head.sh FOLDER_OF_RAY COMMAND...
set -euo pipefail
bin=$1
shift
folder=$(mktemp -d)
port() { python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }
dashboard=$(port)
# Workers would give way to everything else on the machine.
export RAY_worker_niceness=0
# All that it starts ends with it (`ray stop` would end other people's clusters too). Job agents take ports of their own.
PATH=$bin:$PATH "$bin/ray" start --head --block --node-ip-address 127.0.0.1 --port "$(port)" --ray-client-server-port "$(port)" \
  --dashboard-host 127.0.0.1 --dashboard-port "$dashboard" --dashboard-agent-listen-port "$(port)" --num-cpus 2 \
  --object-store-memory 100000000 --temp-dir "$folder" --disable-usage-stats >"$folder.log" 2>&1 &
head=$!
cleanup() {
  kill "$head" 2>/dev/null || true
  wait "$head" 2>/dev/null || true
  rm -rf "$folder" "$folder.log"
}
trap cleanup EXIT
export RAY_API_SERVER_ADDRESS=http://127.0.0.1:$dashboard
for ((k = 0; k < 120; k++)); do
  PATH=$bin:$PATH "$bin/ray" job list >/dev/null 2>&1 && break
  kill -0 "$head" 2>/dev/null || { cat "$folder.log"; exit 1; }
  sleep 0.5
done
code=0
"$@" || code=$?
exit "$code"
