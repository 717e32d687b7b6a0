# Installs BUILD, moves the installed tree elsewhere, and builds and runs a user's project against it, all below FOLDER.
# Needs BUILD, SOURCE, PROJECTS, FOLDER, GENERATOR, COMPILER, TYPE.
function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${ARGV}\nended with ${status}:\n${output}")
  endif()
endfunction()

file(REMOVE_RECURSE "${FOLDER}")
file(MAKE_DIRECTORY "${FOLDER}")
run("${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${FOLDER}/first place")
# Nothing in the package may remember where it was made.
file(RENAME "${FOLDER}/first place" "${FOLDER}/moved")
file(GLOB_RECURSE package "${FOLDER}/moved/*.cmake")
foreach(file IN LISTS package)
  file(READ "${file}" text)
  foreach(place IN ITEMS "${SOURCE}/" "${BUILD}/" "first place")
    string(FIND "${text}" "${place}" at)
    if(NOT at EQUAL -1)
      message(FATAL_ERROR "${file} names ${place}")
    endif()
  endforeach()
endforeach()
# The public headers and no others.
file(STRINGS "${SOURCE}/cmake/public-headers.txt" wanted)
file(GLOB_RECURSE installed RELATIVE "${FOLDER}/moved/include" "${FOLDER}/moved/include/*")
list(SORT wanted)
list(SORT installed)
if(NOT installed STREQUAL wanted)
  message(FATAL_ERROR "installed headers:\n${installed}\npublic headers:\n${wanted}")
endif()

foreach(name component project)
  run("${CMAKE_COMMAND}" -S "${PROJECTS}/${name}" -B "${FOLDER}/${name}" -G "${GENERATOR}" "-DCMAKE_PREFIX_PATH=${FOLDER}/moved"
      "-DCMAKE_CXX_COMPILER=${COMPILER}" "-DCMAKE_BUILD_TYPE=${TYPE}")
endforeach()
run("${CMAKE_COMMAND}" --build "${FOLDER}/project")
run("${CMAKE_COMMAND}" -E chdir "${FOLDER}" "${FOLDER}/project/user")
if(NOT EXISTS "${FOLDER}/torus.relief")
  message(FATAL_ERROR "the user's project wrote no model")
endif()
if(EXISTS "${BUILD}/bin/relief")
  run("${FOLDER}/moved/bin/relief" info "${FOLDER}/torus.relief")
endif()
# What docs/tutorials/cpp.md has its reader do, with the same files.
file(COPY "${SOURCE}/examples/project/CMakeLists.txt" "${SOURCE}/examples/hello.cpp" "${SOURCE}/examples/servo_loop.cpp"
     DESTINATION "${FOLDER}/first-steps")
run("${CMAKE_COMMAND}" -S "${FOLDER}/first-steps" -B "${FOLDER}/first-steps/build" -G "${GENERATOR}"
    "-DCMAKE_PREFIX_PATH=${FOLDER}/moved" "-DCMAKE_CXX_COMPILER=${COMPILER}" "-DCMAKE_BUILD_TYPE=${TYPE}")
run("${CMAKE_COMMAND}" --build "${FOLDER}/first-steps/build")
run("${CMAKE_COMMAND}" -E chdir "${FOLDER}/first-steps" build/hello)
run("${CMAKE_COMMAND}" -E chdir "${FOLDER}/first-steps" build/servo_loop)
file(REMOVE_RECURSE "${FOLDER}")
