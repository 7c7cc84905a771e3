# SPDX-License-Identifier: Apache-2.0
# The manual page and the bash completion of a program, from what it says of itself: --help, and `COMMAND --help` of each
# command that this lists.
# cmake -DPROGRAM=<file> -DVERSION=<x.y.z> -DOUT=<folder> [-DALSO=<command that --help does not list>|..]
#       [-DSEE=<page>|..] -P program_pages.cmake
# writes OUT/man/NAME.1 and OUT/completions/NAME.
cmake_minimum_required(VERSION 3.25)

cmake_path(GET PROGRAM FILENAME name)
string(REPLACE "|" ";" also "${ALSO}")
string(REPLACE "|" ";" see "${SEE}")

# help_of(<out: lines> <words>..): a line is an element; brackets and semicolons, which lists know, are kept as bytes 1 to 3.
function(help_of out)
  execute_process(COMMAND ${PROGRAM} ${ARGN} --help OUTPUT_VARIABLE text RESULT_VARIABLE code)
  if(code OR text STREQUAL "")
    message(FATAL_ERROR "${name} ${ARGN} --help: exit code ${code}")
  endif()
  string(ASCII 1 open)
  string(ASCII 2 close)
  string(ASCII 3 semicolon)
  string(REPLACE "[" "${open}" text "${text}")
  string(REPLACE "]" "${close}" text "${text}")
  string(REPLACE ";" "${semicolon}" text "${text}")
  string(REGEX REPLACE "\n+$" "" text "${text}")
  string(REPLACE "\n" ";" lines "${text}")
  set(${out} "${lines}" PARENT_SCOPE)
endfunction()

# As a manual page has it.
function(roff out text)
  string(REPLACE "\\" "\\e" text "${text}")
  string(REPLACE "-" "\\-" text "${text}")
  string(ASCII 1 open)
  string(ASCII 2 close)
  string(ASCII 3 semicolon)
  string(REPLACE "${open}" "[" text "${text}")
  string(REPLACE "${close}" "]" text "${text}")
  string(REPLACE "${semicolon}" ";" text "${text}")
  if(text MATCHES "^[.']")
    set(text "\\&${text}")
  endif()
  set(${out} "${text}" PARENT_SCOPE)
endfunction()

# The rest of a help, from its usage on, as text of the page.
function(body_of out)
  set(page)
  set(verbatim OFF)
  foreach(line IN LISTS ARGN)
    roff(text "${line}")
    if(line MATCHES "^Usage: (.*)$")
      roff(text "${CMAKE_MATCH_1}")
      string(APPEND page ".PP\n.B ${text}\n")
    elseif(line MATCHES "^(Exit codes|Example|Files):? *(.*)$")
      string(APPEND page ".PP\n${text}\n")
    elseif(line MATCHES "^[^ ].*:$")
      string(APPEND page ".PP\n${text}\n")
    elseif(line MATCHES "^  ([^ ].*[^ ])  +([^ ].*)$")
      set(term "${CMAKE_MATCH_1}")
      set(does "${CMAKE_MATCH_2}")
      roff(term "${term}")
      roff(does "${does}")
      string(APPEND page ".TP\n.B ${term}\n${does}\n")
    elseif(line MATCHES "^  ([^ ].*)$")
      roff(term "${CMAKE_MATCH_1}")
      string(APPEND page ".TP\n.B ${term}\n")
    elseif(line MATCHES "^ +([^ ].*)$")
      roff(does "${CMAKE_MATCH_1}")
      string(APPEND page "${does}\n")
    elseif(NOT line STREQUAL "")
      string(APPEND page "${text}\n")
    endif()
  endforeach()
  set(${out} "${page}" PARENT_SCOPE)
endfunction()

# Names of options in lines of help.
function(options_of out)
  set(words)
  foreach(line IN LISTS ARGN)
    if(line MATCHES "^  (-[^ ]+)")
      string(REPLACE "," ";" names "${CMAKE_MATCH_1}")
      list(APPEND words ${names})
    endif()
  endforeach()
  list(JOIN words " " words)
  set(${out} "${words}" PARENT_SCOPE)
endfunction()

help_of(help)
list(POP_FRONT help purpose)
set(own)     # commands with a part of the page
set(others)  # those of another program
set(in_own OFF)
set(in_others OFF)
foreach(line IN LISTS help)
  if(line MATCHES "^Subcommands:$")
    set(in_own ON)
  elseif(line MATCHES "^Subcommands of ")
    set(in_others ON)
  elseif(line STREQUAL "")
    set(in_own OFF)
    set(in_others OFF)
  elseif(line MATCHES "^  ([a-z][a-z-]*)( |$)")
    if(in_own)
      list(APPEND own ${CMAKE_MATCH_1})
    elseif(in_others)
      list(APPEND others ${CMAKE_MATCH_1})
    endif()
  endif()
endforeach()
list(APPEND own ${also})

string(TOUPPER ${name} title)
string(REGEX REPLACE "\\..*$" "" short "${purpose}")
roff(short "${short}")
roff(purpose "${purpose}")
body_of(body ${help})
set(page "\
.\\\" SPDX-License-Identifier: Apache-2.0
.TH ${title} 1 \"\" \"haptic ${VERSION}\" \"User Commands\"
.SH NAME
${name} \\- ${short}
.SH DESCRIPTION
${purpose}
${body}")
set(cases)
foreach(command IN LISTS own others)
  help_of(lines ${command})
  options_of(words ${lines})
  string(APPEND cases "    ${command}) words='${words}' ;;\n")
  if(command IN_LIST own)
    list(POP_FRONT lines does)
    roff(does "${does}")
    body_of(body ${lines})
    roff(heading "${name} ${command}")
    string(APPEND page ".SH \"${heading}\"\n${does}\n${body}")
  endif()
endforeach()
if(see)
  list(TRANSFORM see REPLACE "(.+)" ".BR \\1 (1)")
  list(JOIN see ",\n" see)
  string(APPEND page ".SH \"SEE ALSO\"\n${see}\n")
endif()
file(WRITE ${OUT}/man/${name}.1 "${page}")

options_of(words ${help})
list(JOIN own " " commands)
if(others)
  list(JOIN others " " more)
  string(APPEND commands " ${more}")
endif()
if(commands)
  string(APPEND commands " help")
endif()
file(WRITE ${OUT}/completions/${name} "\
# SPDX-License-Identifier: Apache-2.0
# Completion of ${name} for bash, made from its --help.
_${name}() {
  local word=\${COMP_WORDS[COMP_CWORD]} command=\${COMP_WORDS[1]} words
  case \$command in
${cases}    *) words='${words}' ;;
  esac
  if [[ \$COMP_CWORD -eq 1 || ( \$COMP_CWORD -eq 2 && \$command == help ) ]]; then
    words+=' ${commands}'
  fi
  COMPREPLY=()
  if [[ \$word == -* || -z \$word || \$COMP_CWORD -eq 1 || \$command == help ]]; then
    mapfile -t COMPREPLY < <(compgen -W \"\$words\" -- \"\$word\")
  fi
}
complete -o default -F _${name} ${name}
")
