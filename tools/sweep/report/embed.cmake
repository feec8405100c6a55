# Writes OUTPUT: the text of the page's sources as C++ string literals. Run with -D FOLDER -D OUTPUT -D SCRIPTS.
set(scripts "")
foreach(script IN LISTS SCRIPTS)
    file(READ ${FOLDER}/${script} text)
    string(APPEND scripts "${text}\n")
endforeach()
file(READ ${FOLDER}/page.html html)
file(READ ${FOLDER}/page.css css)
file(WRITE ${OUTPUT} "// Made by embed.cmake.\n#include \"sweep/page_files.h\"\n\nnamespace vlx {\n\n"
    "const std::string_view kPageHtml = R\"vlxpage(${html})vlxpage\";\n\n"
    "const std::string_view kPageCss = R\"vlxpage(${css})vlxpage\";\n\n"
    "const std::string_view kPageScript = R\"vlxpage(${scripts})vlxpage\";\n\n}  // namespace vlx\n")
