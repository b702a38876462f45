# Writes a list of ctest entries, one for each suite of a GoogleTest program: PROGRAM, as NAME.SUITE, to SUITES. To begin a program under
# AddressSanitizer and to look for leaks at its end takes longer than most single tests.
#   cmake -D PROGRAM=... -D NAME=... -D COST=... -D LABELS=... -D FOLDER=... -D SUITES=... -P cmake/test_suites.cmake
execute_process(COMMAND ${PROGRAM} --gtest_list_tests WORKING_DIRECTORY ${FOLDER} OUTPUT_VARIABLE listed COMMAND_ERROR_IS_FATAL ANY)
# Suites stand at the begin of a line and end with a dot; behind it may be a comment of a type. The tests of one are indented.
string(REGEX MATCHALL "(^|\n)[^ \n]+\\." suites "${listed}")
set(entries "")
foreach(suite ${suites})
  string(REGEX REPLACE "^\n?(.*)\\.$" "\\1" suite "${suite}")
  string(APPEND entries "add_test([=[${NAME}.${suite}]=] [=[${PROGRAM}]=] [=[--gtest_filter=${suite}.*]=])\n"
         "set_tests_properties([=[${NAME}.${suite}]=] PROPERTIES WORKING_DIRECTORY [=[${FOLDER}]=] TIMEOUT 900 COST ${COST} SKIP_RETURN_CODE 77 LABELS [=[${LABELS}]=])\n")
endforeach()
if(entries STREQUAL "")
  message(FATAL_ERROR "${PROGRAM} has no tests")
endif()
file(WRITE ${SUITES} "${entries}")
