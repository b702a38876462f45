# CPack runs this before it makes packages for another machine: they depend on what this machine's depend on.
foreach(component CAPTURE TOOLS)
  file(GLOB package ${CPACK_HUELINE_NATIVE_PACKAGES}/${CPACK_DEBIAN_${component}_PACKAGE_NAME}_*.deb)
  if(NOT package)
    message(FATAL_ERROR "there is no package ${CPACK_DEBIAN_${component}_PACKAGE_NAME} in ${CPACK_HUELINE_NATIVE_PACKAGES}: build the target hueline_packages of the preset release first")
  endif()
  execute_process(COMMAND dpkg-deb --field ${package} Depends OUTPUT_VARIABLE depends OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  set(CPACK_DEBIAN_${component}_PACKAGE_DEPENDS "${depends}")
endforeach()
