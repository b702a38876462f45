# cmake -DSOURCE=console/web -DFOLDER=where to work -DPAGE=where the page goes -P build_page.cmake
# Works on a copy, so that nothing is written into the source folder.
find_program(NODE node)
find_program(NPM npm)
if(NOT NODE OR NOT NPM)
  message(FATAL_ERROR "The operator's page needs Node.js (18 or newer) and npm: tools/install installs them. Everything else builds without them.")
endif()
file(MAKE_DIRECTORY ${FOLDER})
file(REMOVE_RECURSE ${FOLDER}/src)
file(COPY ${SOURCE}/ DESTINATION ${FOLDER} PATTERN node_modules EXCLUDE)

# The packages are installed anew only when the lock file has changed.
file(SHA256 ${SOURCE}/package-lock.json lock)
set(installed)
if(EXISTS ${FOLDER}/installed.txt)
  file(READ ${FOLDER}/installed.txt installed)
endif()
if(NOT installed STREQUAL lock)
  execute_process(COMMAND ${NPM} ci --prefer-offline --no-audit --no-fund --loglevel=error WORKING_DIRECTORY ${FOLDER} RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "npm could not install the packages of the operator's page, which console/web/package.json lists. It reaches a registry by "
      "network, or has them in its cache: check `npm ping` and the proxy, then build hueline_console_page again. "
      "Everything else builds without the page.")
  endif()
  file(WRITE ${FOLDER}/installed.txt ${lock})
endif()
foreach(step "node_modules/typescript/bin/tsc --noEmit" "node_modules/vite/bin/vite.js build --emptyOutDir --logLevel warn --outDir ${PAGE}")
  separate_arguments(step UNIX_COMMAND "${step}")
  execute_process(COMMAND ${NODE} ${step} WORKING_DIRECTORY ${FOLDER} RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "the operator's page does not build: see the messages above")
  endif()
endforeach()
