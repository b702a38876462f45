# Writes OUT, a table of the YAML files below SOURCE (rigs, scenarios, sheets) as C++, so that the program has them wherever it is started.
# cmake -DSOURCE=config -DOUT=shipped_files.cpp -P embed.cmake
file(GLOB_RECURSE files RELATIVE ${SOURCE} ${SOURCE}/rigs/*.yaml ${SOURCE}/scenarios/*.yaml ${SOURCE}/sheets/*.yaml)
list(SORT files)
file(WRITE ${OUT} "#include \"config/shipped.hpp\"\n\nnamespace hueline::config {\n\nconst std::vector<ShippedFile>& shipped_files() {\n  static const std::vector<ShippedFile> files = {\n")
foreach(file ${files})
  file(READ ${SOURCE}/${file} text)
  file(APPEND ${OUT} "    {\"${file}\", R\"yaml(${text})yaml\"},\n")
endforeach()
file(APPEND ${OUT} "  };\n  return files;\n}\n\n}  // namespace hueline::config\n")
