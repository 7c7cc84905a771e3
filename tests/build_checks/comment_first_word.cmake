# SPDX-License-Identifier: Apache-2.0
# Rule: a comment of the product's C++ sources begins with its subject, not with What, Whether or Of. Those that there are
# are counted in comment_first_word.txt below ROOT, and their number may only fall.
# cmake -DROOT=<project> [-DLIST=ON] -P comment_first_word.cmake    LIST: names each
include(${CMAKE_CURRENT_LIST_DIR}/source_tree.cmake)

set(figure_file tests/build_checks/comment_first_word.txt)
set(allowed 0)
if(EXISTS ${ROOT}/${figure_file})
  file(STRINGS ${ROOT}/${figure_file} allowed REGEX "^[0-9]+$")
endif()

# A comment is a block of lines that have nothing before their slashes, or stands behind code; `///<` on a line of its own
# continues one.
set(words "///?<?[ \t]*(What|Whether|Of)[ \t\n,:;]")
set(count 0)
set(found)
haptic_source_files(files "\\.(hpp|cpp|h)$" rt_core hal tools host_sim linker)
foreach(path IN LISTS files)
  file(READ ${ROOT}/${path} content)
  if(NOT content MATCHES "${words}")
    continue()
  endif()
  string(REGEX REPLACE "[][;\\]" " " content "\n${content}")
  string(REGEX MATCHALL "\n[ \t]*//[^\n]*(\n[ \t]*//[^\n]*)*|\n[^\n/]*[^\n/ \t][^\n/]*///?<?[ \t]*(What|Whether|Of)[ \t\n,:]"
    comments "${content}")
  foreach(comment IN LISTS comments)
    if((comment MATCHES "^\n[ \t]*///?[ \t]*(What|Whether|Of)[ \t\n,:]") OR (comment MATCHES "^\n[^\n/]*[^\n/ \t][^\n/]*//"))
      math(EXPR count "${count} + 1")
      if(LIST OR count LESS_EQUAL 20)
        string(REGEX REPLACE "^\n[ \t]*([^\n]*).*" "\\1" line "${comment}")
        list(APPEND found "${path}: ${line}")
      endif()
    endif()
  endforeach()
endforeach()

if(LIST)
  list(JOIN found "\n" text)
  message("${text}")
endif()
if(count GREATER allowed)
  haptic_violation("${count} comments begin with What, Whether or Of, and ${figure_file} allows ${allowed}: begin the new one with its subject (-DLIST=ON lists all)")
  if(count LESS_EQUAL 20)
    foreach(line IN LISTS found)
      haptic_violation("${line}")
    endforeach()
  endif()
elseif(count LESS allowed)
  haptic_violation("${count} comments begin with What, Whether or Of, fewer than before: lower the figure in ${figure_file} from ${allowed} to ${count}")
endif()
list(LENGTH files checked)
haptic_report("first word of comments" ${checked})
