# CPack runs this when the files of a package are in their places, before it packs them: they get the time of SOURCE_DATE_EPOCH.
# Folders have the time of the build otherwise, and so would the packages.
if(DEFINED ENV{SOURCE_DATE_EPOCH})
  execute_process(COMMAND find ${CPACK_TEMPORARY_DIRECTORY} -exec touch --no-dereference --date=@$ENV{SOURCE_DATE_EPOCH} {} +
                  COMMAND_ERROR_IS_FATAL ANY)
endif()
