# To be sourced by tests that run the program as a user does, in the folder where they are. The program's output is in said.txt.
fail() { echo "FAILED: $*"; [ ! -e said.txt ] || cat said.txt; exit 1; }
# ends STATUS COMMAND...
ends() { local want=$1; shift; local got=0; "$@" >said.txt 2>&1 || got=$?; [ $got = "$want" ] || fail "'$*' gave $got, not $want"; }
# says REGULAR_EXPRESSION
says() { grep -qE -- "$1" said.txt || fail "not told: $1"; }
