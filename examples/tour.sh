#!/usr/bin/env bash
# A tour of the command line. Needs `relief` on the path; works in the current folder.
set -euo pipefail
cp "$(dirname "${BASH_SOURCE[0]}")"/{press.csv,face.json} .
rm -f carved.relief    # of a tour before: a model with strokes is not replaced

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

# region record
relief touch pumpkin.relief --path press.csv -o force.csv --record press.rlog
relief replay press.rlog --verify             # every tick again, bit for bit
relief replay press.rlog --stiffness 300      # the same motion with a softer surface
relief replay press.rlog --report press.html --csv press-ticks.csv --mcap press.mcap
relief touch pumpkin.relief --device replay:press.rlog -o again.csv    # the recording as a device
# end record

# region sculpt
relief sculpt pumpkin.relief --strokes face.json -o carved.relief
relief undo carved.relief
relief redo carved.relief
# end sculpt

# region out
relief render carved.relief -o carved.png --size 640x360
relief export carved.relief carved.glb
# end out

# The recording reads without relief, too, and says what the forces say.
python3 "$(dirname "${BASH_SOURCE[0]}")/read_recording.py" press.rlog > strongest.txt
awk -F, 'NR > 1 { f = sqrt($17 * $17 + $18 * $18 + $19 * $19); if (f > most) most = f } END { printf "%.3f N\n", most }' force.csv > most.txt
grep -q -F "$(cat most.txt)" strongest.txt

# So does a model, as long as no stroke has made its grids finer.
python3 "$(dirname "${BASH_SOURCE[0]}")/read_model.py" pumpkin.relief > model.txt
grep -q "stroke 0 of 0" model.txt

# The path pressed into the surface, and everything was written.
awk -F, 'NR > 1 && $5 == 1 && $19 > 0 { felt = 1 } END { exit !felt }' force.csv
for file in pumpkin.ply pumpkin.relief force.csv explored.csv carved.relief carved.png carved.glb press.html press.mcap press-ticks.csv again.csv; do [ -s "$file" ]; done
