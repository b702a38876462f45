# For tests that run the program as a user does, in the folder they are in; sourced. What it said is in said.txt.
fail() { echo "FAILED: $*"; [ ! -e said.txt ] || cat said.txt; exit 1; }
# ends STATUS COMMAND...
ends() { local want=$1; shift; local got=0; "$@" >said.txt 2>&1 || got=$?; [ $got = "$want" ] || fail "'$*' gave $got, not $want"; }
# says REGULAR_EXPRESSION
says() { grep -qE -- "$1" said.txt || fail "not told: $1"; }
