# One place for how a folder becomes a library, a test, a fuzz target or a benchmark.

add_library(hueline_options INTERFACE)
target_compile_features(hueline_options INTERFACE cxx_std_20)
# Whoever uses the installed libraries has warnings of their own.
foreach(warning -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Wno-sign-conversion -Werror)
  target_compile_options(hueline_options INTERFACE $<BUILD_INTERFACE:${warning}>)
endforeach()
# GCC 12 finds copies beyond strings of the standard library where there are none (GCC bugs 105329, 105651), the more so with
# precompiled headers. clang and AddressSanitizer look at the same code.
target_compile_options(hueline_options INTERFACE
  $<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds;-Wno-restrict;-Wno-stringop-overflow;-Wno-stringop-overread>>)
# Locks are checked by clang (core/mutex.hpp), which the builds with sanitizers use.
target_compile_options(hueline_options INTERFACE $<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:Clang>:-Wthread-safety>>)
# Aravis asks for -pthread. Precompiled headers serve only what is compiled with the same options, so everything is.
target_compile_options(hueline_options INTERFACE $<BUILD_INTERFACE:-pthread>)
target_compile_options(hueline_options INTERFACE -fno-math-errno
                       # The same bytes on every machine: no contraction of a*b+c that depends on the compiler's mood.
                       -ffp-contract=off)
if(CMAKE_SYSTEM_PROCESSOR STREQUAL "aarch64")
  # Eigen would fuse multiplications and additions, as it cannot on every machine.
  target_compile_options(hueline_options INTERFACE -U__ARM_FEATURE_FMA)
endif()
target_include_directories(hueline_options INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:include/hueline>)
target_link_libraries(hueline_options INTERFACE Threads::Threads fmt::fmt)
# Libraries' own headers are not ours to warn about.
target_include_directories(hueline_options SYSTEM INTERFACE ${EIGEN3_INCLUDE_DIR})

set(HUELINE_SANITIZE "" CACHE STRING "address (with undefined), thread, or empty")
if(HUELINE_SANITIZE STREQUAL "address")
  # Two checks of UBSan are left out, for AddressSanitizer finds the same faults: a null pointer is a bad address, and an object that is
  # smaller than its use has a red zone behind it. Together they cost a tenth of the build.
  target_compile_options(hueline_options INTERFACE -fsanitize=address,undefined -fno-sanitize=null,object-size
                         -fno-sanitize-recover=all -fno-omit-frame-pointer
                         -fsanitize-ignorelist=${PROJECT_SOURCE_DIR}/cmake/sanitizers.txt)
  target_compile_definitions(hueline_options INTERFACE HUELINE_SANITIZE_ADDRESS)
  target_link_options(hueline_options INTERFACE -fsanitize=address,undefined)
elseif(HUELINE_SANITIZE STREQUAL "thread")
  target_compile_options(hueline_options INTERFACE -fsanitize=thread)
  target_compile_definitions(hueline_options INTERFACE HUELINE_SANITIZE_THREAD)
  target_link_options(hueline_options INTERFACE -fsanitize=thread)
endif()
if(HUELINE_SANITIZE)
  # A test program with its sanitizer is linked in half the time.
  find_program(LLD NAMES ld.lld-14)
  if(LLD AND CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    target_link_options(hueline_options INTERFACE -fuse-ld=lld)
  endif()
endif()
# Under the sanitizers code that does not compute for long is not optimised and calls AddressSanitizer's checks instead of having them
# written out at each access, for that would be half of what it costs to compile: the commands, and a test's own files. Tests that compute
# for long are OPTIMISED: the linker takes an inline function from the test's files, where it is slow, for the libraries too.
add_library(hueline_brief_options INTERFACE)
if(HUELINE_SANITIZE)
  target_compile_options(hueline_brief_options INTERFACE -O0)
endif()
if(HUELINE_SANITIZE STREQUAL "address")
  target_compile_options(hueline_brief_options INTERFACE -fsanitize-address-outline-instrumentation)
endif()

# Parsing the standard library, Eigen and fmt is half of what a small file costs. They are parsed once: a file that forgets to include one
# of them still compiles, so tests/includes_test.sh looks at the includes.
option(HUELINE_PRECOMPILE "parse the libraries' headers once" ON)
if(HUELINE_PRECOMPILE)
  file(WRITE ${CMAKE_BINARY_DIR}/precompiled.cpp "")
  set(headers <algorithm> <array> <atomic> <chrono> <cmath> <cstdint> <cstring> <deque> <filesystem> <fstream> <functional> <limits> <map> <memory> <mutex>
              <numbers> <optional> <random> <set> <span> <string> <string_view> <thread> <tuple> <utility> <variant> <vector>
              <fmt/format.h> <Eigen/Core> <Eigen/Geometry>)
  add_library(hueline_precompiled OBJECT ${CMAKE_BINARY_DIR}/precompiled.cpp)
  target_link_libraries(hueline_precompiled PRIVATE hueline_options)
  target_precompile_headers(hueline_precompiled PRIVATE ${headers})
  if(HUELINE_SANITIZE)
    add_library(hueline_precompiled_brief OBJECT ${CMAKE_BINARY_DIR}/precompiled.cpp)
    target_link_libraries(hueline_precompiled_brief PRIVATE hueline_options hueline_brief_options)
    target_precompile_headers(hueline_precompiled_brief PRIVATE ${headers})
  endif()
  if(HUELINE_TESTS)
    find_package(GTest REQUIRED)
    add_library(hueline_precompiled_test OBJECT ${CMAKE_BINARY_DIR}/precompiled.cpp)
    target_link_libraries(hueline_precompiled_test PRIVATE hueline_options hueline_brief_options GTest::gmock)
    target_precompile_headers(hueline_precompiled_test PRIVATE ${headers} <gmock/gmock.h> <gtest/gtest.h>)
    add_library(hueline_precompiled_optimised_test OBJECT ${CMAKE_BINARY_DIR}/precompiled.cpp)
    target_link_libraries(hueline_precompiled_optimised_test PRIVATE hueline_options GTest::gmock)
    target_precompile_headers(hueline_precompiled_optimised_test PRIVATE ${headers} <gmock/gmock.h> <gtest/gtest.h>)
  endif()
endif()
# Half of what is left of a file's cost are the headers and templates that its neighbours compile too: 24 files of a target are compiled as
# one, which takes three quarters of the time of 8 as one. So a name in an unnamed namespace stands once in a folder. Without
# (-DHUELINE_UNITY=OFF) a change compiles sooner, and all takes more than twice as long.
option(HUELINE_UNITY "compile several files of a target as one" ON)
set(CMAKE_UNITY_BUILD ${HUELINE_UNITY})
set(CMAKE_UNITY_BUILD_BATCH_SIZE 24)
if(HUELINE_UNITY)
  # GCC takes a type that only one of the files knows for a type of a header.
  target_compile_options(hueline_options INTERFACE $<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>>)
endif()
# hueline_alone(a.cpp b.cpp): files whose names stand in their neighbours too, because they are those of a protocol, say.
function(hueline_alone)
  set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()
# For a processor without vectors GCC compiles Highway's single lanes, and clang would emulate vectors in arrays: other code than what people
# run, which with AddressSanitizer takes up to two thirds of what such a file costs to compile.
if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  target_compile_definitions(hueline_options INTERFACE HWY_BROKEN_EMU128=1)
endif()
# What ThreadSanitizer looks for does not depend on the set of vector instructions, so there the usual one and that of every processor are enough.
if(HUELINE_SANITIZE STREQUAL "thread")
  target_compile_definitions(hueline_options INTERFACE "HWY_DISABLED_TARGETS=(HWY_SSSE3|HWY_SSE4|HWY_AVX3)")
endif()
# Files that are compiled once for each instruction set. GCC 12 crashes in <arm_sve.h> after a precompiled header. UBSan's look at each step of
# a pointer would be half of what such a file costs to compile, and what it would find AddressSanitizer finds.
function(hueline_vectorised)
  hueline_alone(${ARGN})
  if(HUELINE_SANITIZE STREQUAL "address")
    set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS -fno-sanitize=pointer-overflow)
  endif()
  if(CMAKE_SYSTEM_PROCESSOR STREQUAL "aarch64")
    set_source_files_properties(${ARGN} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
  endif()
endfunction()
function(hueline_precompile target precompiled)
  if(HUELINE_PRECOMPILE)
    target_precompile_headers(${target} REUSE_FROM ${precompiled})
  endif()
endfunction()

# hueline_brief(hueline): a library or program that does not compute for long.
function(hueline_brief target)
  target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:hueline_brief_options>)
  if(HUELINE_SANITIZE)
    hueline_precompile(${target} hueline_precompiled_brief)
  else()
    hueline_precompile(${target} hueline_precompiled)
  endif()
endfunction()

# hueline_module(core SOURCES a.cpp b.cpp DEPENDS hueline_core fmt::fmt): static library hueline_<name>. BRIEF: it does not compute for long.
function(hueline_module name)
  cmake_parse_arguments(M "BRIEF" "" "SOURCES;DEPENDS" ${ARGN})
  add_library(hueline_${name} STATIC ${M_SOURCES})
  target_link_libraries(hueline_${name} PUBLIC hueline_options ${M_DEPENDS})
  if(M_BRIEF)
    hueline_brief(hueline_${name})
  else()
    hueline_precompile(hueline_${name} hueline_precompiled)
  endif()
endfunction()

# hueline_test(core_time SOURCES time_test.cpp DEPENDS hueline_core [LABELS x]): one GoogleTest program, one ctest entry a suite
# (cmake/test_suites.cmake). OPTIMISED: it computes for long. HUELINE_DATA reaches the tests through tests/support/test_data.hpp.
function(hueline_test name)
  cmake_parse_arguments(T "OPTIMISED" "" "SOURCES;DEPENDS;LABELS" ${ARGN})
  add_executable(${name}_test ${T_SOURCES})
  target_link_libraries(${name}_test PRIVATE ${T_DEPENDS} hueline_test_support hueline_test_main)
  set(cost 1)
  if(T_OPTIMISED)
    hueline_precompile(${name}_test hueline_precompiled_optimised_test)
    set(cost 100)  # ctest begins with what costs most: what takes long should not be left at the end
  else()
    target_link_libraries(${name}_test PRIVATE hueline_brief_options)
    hueline_precompile(${name}_test hueline_precompiled_test)
  endif()
  set(suites ${CMAKE_CURRENT_BINARY_DIR}/${name}_suites.cmake)
  add_custom_command(TARGET ${name}_test POST_BUILD BYPRODUCTS ${suites} VERBATIM
                     COMMAND ${CMAKE_COMMAND} -D PROGRAM=$<TARGET_FILE:${name}_test> -D NAME=${name} -D COST=${cost} -D "LABELS=${T_LABELS}"
                             -D FOLDER=${CMAKE_CURRENT_BINARY_DIR} -D SUITES=${suites} -P ${PROJECT_SOURCE_DIR}/cmake/test_suites.cmake)
  file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/${name}_tests.cmake
       "if(EXISTS \"${suites}\")\n  include(\"${suites}\")\nelse()\n  add_test(${name}_NOT_BUILT ${name}_NOT_BUILT)\nendif()\n")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${CMAKE_CURRENT_BINARY_DIR}/${name}_tests.cmake)
endfunction()

# Tests in real time run one at a time, and begin first. Beside them run patient tests, which compute for long and leave the processor to
# whoever wants it: how long they take depends on the others, so their limit ends only what hangs.
#   set_tests_properties(apps.drive PROPERTIES ${HUELINE_LIVE})
#   hueline_patient_test(apps.score SCRIPT [ARGUMENT...])
set(HUELINE_LIVE RESOURCE_LOCK live COST 10000)
function(hueline_patient_test name)
  add_test(NAME ${name} COMMAND nice -n 19 ${ARGN})
  set_tests_properties(${name} PROPERTIES COST 500 TIMEOUT 1800)
endfunction()

# hueline_fuzz(velodyne SOURCES velodyne_fuzz.cpp DEPENDS hueline_drivers CORPUS velodyne): LLVMFuzzerTestOneInput.
# With HUELINE_FUZZ (clang) the target is a libFuzzer program; otherwise our own seeded mutator (tests/fuzz/driver.cpp) runs it
# for a fixed number of inputs, so that every test run fuzzes. CORPUS: folders below HUELINE_DATA.
function(hueline_fuzz name)
  cmake_parse_arguments(F "" "" "SOURCES;DEPENDS;CORPUS" ${ARGN})
  add_executable(${name}_fuzz ${F_SOURCES})
  set_target_properties(${name}_fuzz PROPERTIES UNITY_BUILD OFF)  # the driver has its own words for bytes
  target_link_libraries(${name}_fuzz PRIVATE ${F_DEPENDS})
  if(NOT HUELINE_FUZZ)
    hueline_precompile(${name}_fuzz hueline_precompiled)
  endif()
  set(corpus "")
  foreach(folder ${F_CORPUS})
    list(APPEND corpus ${HUELINE_DATA}/${folder})
  endforeach()
  if(HUELINE_FUZZ)
    target_link_options(${name}_fuzz PRIVATE -fsanitize=fuzzer)
    target_compile_options(${name}_fuzz PRIVATE -fsanitize=fuzzer-no-link)
    add_test(NAME fuzz.${name} COMMAND ${name}_fuzz -max_total_time=20 -print_final_stats=1 ${corpus})
  else()
    target_sources(${name}_fuzz PRIVATE ${PROJECT_SOURCE_DIR}/tests/fuzz/driver.cpp)
    add_test(NAME fuzz.${name} COMMAND ${name}_fuzz --inputs 2000 ${corpus})
  endif()
  set_tests_properties(fuzz.${name} PROPERTIES TIMEOUT 300 LABELS fuzz)
endfunction()

# hueline_bench(storage SOURCES ... DEPENDS ...): Google Benchmark program for people (docs/performance.md). Each test run does every benchmark
# once, briefly: one that does not do what it measures fails.
function(hueline_bench name)
  cmake_parse_arguments(B "" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name}_bench ${B_SOURCES})
  target_link_libraries(${name}_bench PRIVATE ${B_DEPENDS} hueline_bench_main)
  hueline_brief(${name}_bench)  # under the sanitizers it shows only that its work is done
  add_test(NAME bench.${name} COMMAND ${name}_bench --benchmark_min_time=0.000001)
  set_tests_properties(bench.${name} PROPERTIES ENVIRONMENT HUELINE_BENCH_BRIEF=1 SKIP_RETURN_CODE 77 TIMEOUT 300 LABELS bench)
endfunction()
