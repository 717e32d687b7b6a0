# shellcheck shell=bash
# Progress of long work in one line, and its log in a file; for ./dev and tools/install-deps.
# On a terminal the line is drawn anew each time; elsewhere there is a plain line for each tenth.

progress_root=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.." && pwd)
progress_last=

# log_file NAME: the path of a new, empty log.
log_file() {
  local folder="$progress_root/build/log"
  mkdir -p "$folder"
  : >"$folder/$1.log"
  echo "$folder/$1.log"
}

# show_progress NAME PERCENT TEXT
show_progress() {
  local width
  if [ -t 2 ]; then
    width=$(( ${COLUMNS:-80} - 1 ))
    printf '\r\033[K%s' "$(printf '%s %3d %%, %s' "$1" "$2" "$3" | cut -c "1-$width")" >&2
  elif [ "$1 $(($2 / 10))" != "$progress_last" ]; then
    printf '%s %3d %%, %s\n' "$1" "$2" "$3" >&2
  fi
  progress_last="$1 $(($2 / 10))"
}

# The line is over; what follows begins at the left.
end_progress() {
  if [ -t 2 ] && [ -n "$progress_last" ]; then printf '\r\033[K' >&2; fi
  progress_last=
}

# show_log FILE: what a failure is to be judged by.
show_log() {
  tail -n 40 "$1" >&2
  echo "The whole log is $1" >&2
}

# with_progress NAME LOG COMMAND...: runs the command with what it says in the log; its lines that begin with [i/n], as
# ninja's do, are its progress. When it fails, the end of the log is shown. The status is the command's.
with_progress() {
  local name=$1 log=$2 status
  shift 2
  "$@" 2>&1 | {
    local line at of
    while IFS= read -r line; do
      printf '%s\n' "$line" >>"$log"
      if [[ $line =~ ^\[([0-9]+)/([0-9]+)\] ]]; then
        at=${BASH_REMATCH[1]} of=${BASH_REMATCH[2]}
        show_progress "$name" $((at * 100 / of)) "step $at of $of"
      fi
    done
    end_progress
  } && status=0 || status=$?
  [ "$status" -eq 0 ] || show_log "$log"
  return "$status"
}
