#!/usr/bin/env bash
# The tour of README.md. Needs `relief` on the path; works in the current folder.
set -euo pipefail
cp "$(dirname "${BASH_SOURCE[0]}")"/{press.csv,face.json} .

# region make
relief sample pumpkin -o pumpkin.ply --triangles 100000
relief convert pumpkin.ply -o pumpkin.relief --slabs 200
relief verify pumpkin.relief    # the independent verifier
relief info pumpkin.relief
# end make

# region touch
relief touch pumpkin.relief --path press.csv -o force.csv    # t,x,y,z in; contact, depth, force out
relief touch pumpkin.relief --device sim:hand --seconds 1 -o explored.csv
# end touch

# region sculpt
relief sculpt pumpkin.relief --strokes face.json -o carved.relief
relief undo carved.relief
relief redo carved.relief
# end sculpt

# region out
relief render carved.relief -o carved.png --size 640x360
relief export carved.relief carved.glb
# end out

# The path pressed into the surface, and everything was written.
awk -F, 'NR > 1 && $5 == 1 && $19 > 0 { felt = 1 } END { exit !felt }' force.csv
for file in pumpkin.ply pumpkin.relief force.csv explored.csv carved.relief carved.png carved.glb; do [ -s "$file" ]; done
