# Debian packages: cmake --build --preset release --target hueline_packages writes build/release/packages/*.deb
#   hueline-capture  what a vehicle needs: drivers, runtime, console; neither simulator nor adjustment
#   hueline-tools    the office commands
#   libhueline-dev   libraries and headers
#   hueline-doc      the documents
# The same revision gives the same bytes: times of files are those of the commit.
find_package(Git QUIET)
set(packages ${PROJECT_BINARY_DIR}/packages)
set(package_parts ${PROJECT_BINARY_DIR}/package_parts)  # files of the packages that are made

# A version that grows with the commits, as apt wants it: 0.1.0+202611230515.5eccbb6-0hueline1
set(commit_time 0)
set(package_version ${PROJECT_VERSION})
set(package_release 0hueline1)  # no revision of Debian's own
if(GIT_FOUND)
  execute_process(COMMAND ${CMAKE_COMMAND} -E env TZ=UTC ${GIT_EXECUTABLE} log -1 --date=format-local:%Y%m%d%H%M "--format=%ct;%cd;%h"
                  WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(commit)
    list(GET commit 0 commit_time)
    list(GET commit 1 minute)
    list(GET commit 2 revision)
    set(package_version ${PROJECT_VERSION}+${minute}.${revision})
  endif()
endif()
if(DEFINED ENV{SOURCE_DATE_EPOCH})
  set(commit_time $ENV{SOURCE_DATE_EPOCH})
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME hueline)
set(CPACK_PACKAGE_VERSION ${package_version})
set(CPACK_PACKAGE_CONTACT "hueline maintainers <maintainers@hueline.example>")
set(CPACK_OUTPUT_FILE_PREFIX ${packages})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/cmake/package_times.cmake)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_COMPONENTS_ALL capture tools dev doc)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE ${package_release})
if(CMAKE_CROSSCOMPILING)
  # Debian's tool that finds the packages of libraries knows those of this machine only. The packages that were made for it are asked
  # instead: one release of Debian has the same libraries on all machines (tools/arm64 compares what the programs need).
  set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS OFF)
  set(CPACK_PROJECT_CONFIG_FILE ${PROJECT_SOURCE_DIR}/cmake/package_dependencies.cmake)
  set(CPACK_HUELINE_NATIVE_PACKAGES ${PROJECT_SOURCE_DIR}/build/release/packages)
  set(native_programs ${PROJECT_SOURCE_DIR}/build/release/bin)  # their --help is the manual
else()
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
  set(native_programs ${CMAKE_RUNTIME_OUTPUT_DIRECTORY})
endif()
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE zstd)  # xz packs a quarter smaller, and takes ten times as long

set(same_version "(= ${package_version}-${package_release})")
set(CPACK_DEBIAN_CAPTURE_PACKAGE_NAME hueline-capture)
set(CPACK_DEBIAN_CAPTURE_PACKAGE_SECTION science)
set(CPACK_DEBIAN_CAPTURE_PACKAGE_DEPENDS "proj-data, systemd")
set(CPACK_DEBIAN_CAPTURE_PACKAGE_RECOMMENDS "chrony, udev")
set(CPACK_DEBIAN_CAPTURE_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/packaging/debian/postinst ${PROJECT_SOURCE_DIR}/packaging/debian/prerm
    ${PROJECT_SOURCE_DIR}/packaging/debian/postrm)
set(CPACK_COMPONENT_CAPTURE_DESCRIPTION "mobile mapping: records the sensors of a vehicle and colours its points
Records a panoramic camera, laser scanners, a POS (GNSS/INS) and its pulse
per second, byte by byte as received, and colours the laser points while the
vehicle drives. A replay of the recording gives the same bytes.

This package has what a vehicle needs: the drivers, capture and replay, and
the server of the operator's page.")
set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME hueline-tools)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SECTION science)
set(CPACK_DEBIAN_TOOLS_PACKAGE_DEPENDS "hueline-capture ${same_version}")
set(CPACK_COMPONENT_TOOLS_DESCRIPTION "mobile mapping: calibration, panoramas, simulator and score
The office commands of hueline: they calibrate lenses and mountings, measure
objects in images, join panoramas, fuse many drives again, simulate drives
with their truth and judge the results of a version by it. `hueline' starts
them.")
set(CPACK_DEBIAN_DEV_PACKAGE_NAME libhueline-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_SHLIBDEPS OFF)
# What hueline-config.cmake asks for.
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "cmake, libaravis-dev, libdeflate-dev, libeigen3-dev, libfmt-dev, libhwy-dev, libjpeg62-turbo-dev, liblz4-dev, libpng-dev, libproj-dev, libprotobuf-dev, libpugixml-dev, libturbojpeg0-dev, libusb-1.0-0-dev, libwebp-dev, libyaml-cpp-dev, libzstd-dev, nlohmann-json3-dev, pkg-config, protobuf-compiler")
set(CPACK_DEBIAN_DEV_PACKAGE_SUGGESTS "hueline-doc, libembree-dev")
set(CPACK_COMPONENT_DEV_DESCRIPTION "mobile mapping: libraries and headers of hueline
Static libraries, headers and a CMake package, for programs that read
recordings, add devices or use the fusion: find_package(hueline).
hueline::sim needs libembree-dev.")
set(CPACK_DEBIAN_DOC_PACKAGE_NAME hueline-doc)
set(CPACK_DEBIAN_DOC_PACKAGE_SECTION doc)
set(CPACK_DEBIAN_DOC_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DOC_PACKAGE_ARCHITECTURE all)
set(CPACK_COMPONENT_DOC_DESCRIPTION "mobile mapping: documents of hueline
How to operate hueline, the keys of rigs and scenarios, file formats,
methods, accuracy and benchmarks, and a cookbook of programs.")

install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/hueline-doc COMPONENT doc)
install(FILES README.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/hueline-doc COMPONENT doc)
foreach(package capture:hueline-capture tools:hueline-tools dev:libhueline-dev doc:hueline-doc)
  string(REGEX REPLACE ":.*" "" component ${package})
  string(REGEX REPLACE ".*:" "" name ${package})
  install(FILES ${package_parts}/changelog.gz ${package_parts}/changelog.Debian.gz packaging/debian/copyright
          DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} COMPONENT ${component} OPTIONAL)
endforeach()
foreach(component capture tools)
  install(DIRECTORY ${package_parts}/man/${component}/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT ${component} OPTIONAL)
endforeach()

add_custom_command(
  OUTPUT ${package_parts}/man/made
  COMMAND ${CMAKE_COMMAND} -E env SOURCE_DATE_EPOCH=${commit_time} ${PROJECT_SOURCE_DIR}/packaging/manual.sh ${native_programs} ${package_parts}/man
  COMMAND ${CMAKE_COMMAND} -E touch ${package_parts}/man/made
  DEPENDS hueline hueline-office hueline-console packaging/manual.sh
  COMMENT "the manual pages, from each command's --help"
  VERBATIM)
add_custom_command(
  OUTPUT ${package_parts}/changelog.gz ${package_parts}/changelog.Debian.gz
  COMMAND ${PROJECT_SOURCE_DIR}/packaging/changelog.sh ${package_version}-${package_release} ${commit_time} ${package_parts}
  DEPENDS CHANGELOG.md packaging/changelog.sh
  VERBATIM)
add_custom_target(hueline_packages
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${packages}
  COMMAND ${CMAKE_COMMAND} -E env SOURCE_DATE_EPOCH=${commit_time} ${CMAKE_CPACK_COMMAND} --config ${PROJECT_BINARY_DIR}/CPackConfig.cmake
  DEPENDS hueline_programs hueline_console_page ${package_parts}/man/made ${package_parts}/changelog.gz
  COMMENT "Debian packages in ${packages}"
  VERBATIM)
include(CPack)
