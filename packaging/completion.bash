# Completion of hueline and hueline-console: the program says what may follow, so no list of words is kept here.
# Where it says nothing, bash completes names of files.
_hueline() {
  local IFS=$'\n' current=${COMP_WORDS[COMP_CWORD]}
  COMPREPLY=($(compgen -W "$("$1" --complete "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)" -- "$current"))
}
complete -o default -F _hueline hueline hueline-console
