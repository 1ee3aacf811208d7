# Completion for bash, for moldloft and moldloft-sim: commands and options as the program itself lists them, words where an
# option has a choice, files elsewhere.

# What --help lists under a heading: the first word of its lines.
_moldloft_listed() {  # HEADING PROGRAM [COMMAND]
  local heading=$1
  shift
  "$@" --help 2>/dev/null | awk -v heading="$heading" '
    /^[^ ]/ { inside = index($0, heading) == 1 }
    inside && /^  [^ ]/ { word = $1; sub(/^-h,/, "", word); print word }'
}

_moldloft() {
  local program=$1 word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} command="" words=""
  COMPREPLY=()
  [ "$COMP_CWORD" -gt 1 ] && command=${COMP_WORDS[1]}
  # bash takes the = of --plate=wave for a word of its own.
  if [ "$word" = "=" ]; then word=""; elif [ "$before" = "=" ]; then before=${COMP_WORDS[COMP_CWORD - 2]}; fi
  case "${program##*/} $command $before" in
    moldloft-sim\ *\ --plate) words="flat cylinder saddle twist dome wave"; compopt -o default 2>/dev/null ;;
    moldloft-sim\ *\ --design) words="flat cylinder saddle twist dome wave" ;;
    moldloft-sim\ *\ --plates) words="all flat cylinder saddle twist dome wave" ;;
    *\ inspect\ --outline) words="use ignore" ;;
    *\ inspect\ --align) words="best robust above below corners datum none" ;;
    *\ inspect\ --unit) words="mm cm m in ft" ;;
    *\ --outline) words="square rectangle trapezoid parallelogram" ;;
    *\ --outlines) words="all square rectangle trapezoid parallelogram" ;;
    *\ --unit) words="mm m" ;;
    *\ --arm) words="scara gantry" ;;
    *\ --clock) words="virtual real" ;;
    *\ --compare) words=cyclictest ;;
    *\ tell\ tell) [[ $word == -* ]] || words="unhold hold stop abort clear status" ;;&
    *)
      if [ -n "$words" ]; then
        :
      elif [ -z "$command" ]; then
        words="$(_moldloft_listed Subcommands: "$program") --help --version"
      elif [[ $word == -* ]]; then
        words=$(_moldloft_listed Options: "$program" "$command")
      fi ;;
  esac
  [ -n "$words" ] && mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
  # Nothing of ours fits: the name of a file or folder.
  [ ${#COMPREPLY[@]} -eq 0 ] && [[ $word != -* ]] && mapfile -t COMPREPLY < <(compgen -f -- "$word")
  return 0
}

complete -o filenames -F _moldloft moldloft moldloft-sim moldloft-cad
