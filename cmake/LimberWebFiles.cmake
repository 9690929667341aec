# limber_web_files(VARIABLE FOLDER): a source that has all files below FOLDER in it, as server/web/compiled_in.h declares
# them; its name goes to VARIABLE. The folder may be absent or empty.
function(limber_web_files variable folder)
  file(GLOB_RECURSE files CONFIGURE_DEPENDS RELATIVE "${folder}" "${folder}/*")
  set(blocks "")
  set(names "")
  set(rows "")
  set(number 0)
  set(paths "")
  foreach(file IN LISTS files)
    set(path "${folder}/${file}")
    list(APPEND paths "${path}")
    set(name "limber_web_file_${number}")
    string(APPEND blocks "asm(\".section .rodata\\n${name}_begin:\\n.incbin \\\"${path}\\\"\\n${name}_end:\\n.byte 0\\n.previous\");\n")
    string(APPEND names "extern \"C\" const char ${name}_begin[], ${name}_end[];\n")
    string(APPEND rows "    {\"${file}\", ${name}_begin, ${name}_end},\n")
    math(EXPR number "${number} + 1")
  endforeach()
  set(source "${CMAKE_CURRENT_BINARY_DIR}/web_files.cpp")
  set(text "// Made by cmake/LimberWebFiles.cmake.\n#include <array>\n\n#include \"server/web/compiled_in.h\"\n\n${blocks}${names}
namespace limber::server::web {

std::span<const CompiledIn> compiled_in_files() {
  static const std::array<CompiledIn, ${number}> files{{
${rows}  }};
  return files;
}

}  // namespace limber::server::web
")
  file(CONFIGURE OUTPUT "${source}" CONTENT "@text@" @ONLY)
  set_source_files_properties("${source}" PROPERTIES OBJECT_DEPENDS "${paths}" SKIP_PRECOMPILE_HEADERS ON)
  set(${variable} "${source}" PARENT_SCOPE)
endfunction()
