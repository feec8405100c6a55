# Writes OUTPUT: the sources of a page as the constant NAME (page.h). Run with -D HTML -D CSS -D SCRIPTS -D NAME -D OUTPUT.
set(scripts "")
foreach(script IN LISTS SCRIPTS)
    file(READ ${script} text)
    string(APPEND scripts "${text}\n")
endforeach()
file(READ ${HTML} html)
file(READ ${CSS} css)
file(WRITE ${OUTPUT} "// Made by embed.cmake.\n#include \"page/page.h\"\n\nnamespace vlx {\n\n"
    "extern const PageSources ${NAME};\nconst PageSources ${NAME} = {R\"vlxpage(${html})vlxpage\",\n\n"
    "R\"vlxpage(${css})vlxpage\",\n\nR\"vlxpage(${scripts})vlxpage\"};\n\n}  // namespace vlx\n")
