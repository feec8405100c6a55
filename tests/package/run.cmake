# The steps of the package test: see CMakeLists.txt. Any failure ends the script.
function(run)
    execute_process(COMMAND ${ARGV} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
    if(NOT result EQUAL 0)
        list(JOIN ARGV " " command)
        message(FATAL_ERROR "${command}\nended with ${result}:\n${output}")
    endif()
    set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/first)
# A package must work wherever it is moved to.
file(RENAME ${WORK}/first ${WORK}/prefix)

set(flags)
if(SANITIZE)
    set(flags -fsanitize=${SANITIZE})
endif()
run(${CMAKE_COMMAND} -S ${CONSUMER} -B ${WORK}/build -G ${GENERATOR} -D CMAKE_CXX_COMPILER=${COMPILER}
    -D CMAKE_BUILD_TYPE=${BUILD_TYPE} -D CMAKE_PREFIX_PATH=${WORK}/prefix "-DCMAKE_CXX_FLAGS=${flags}")
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${CMAKE_COMMAND} -E chdir ${WORK}/build ./consumer)
if(NOT output MATCHES "all well")
    message(FATAL_ERROR "the consumer said:\n${output}")
endif()

# Nothing of this machine may have got into the package.
file(GLOB texts ${WORK}/prefix/lib/cmake/variolux/*.cmake)
foreach(text IN LISTS texts)
    file(READ ${text} content)
    string(FIND "${content}" "${BUILD}" found)
    if(NOT found EQUAL -1)
        message(FATAL_ERROR "${text} names the build folder")
    endif()
endforeach()

# The installed tools run.
file(GLOB tools ${WORK}/prefix/bin/*)
if(NOT tools)
    message(FATAL_ERROR "no tools were installed")
endif()
foreach(tool IN LISTS tools)
    run(${tool} --version)
endforeach()
