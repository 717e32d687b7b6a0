# relief_library(NAME SOURCES ... PUBLIC ... PRIVATE ...): one static library relief::NAME per folder, header beside source.
set(RELIEF_WARNINGS -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wdouble-promotion -Wnon-virtual-dtor)

function(relief_compile_options target)
  target_compile_features(${target} PUBLIC cxx_std_23)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON
                                             POSITION_INDEPENDENT_CODE ON)
  # Shared samples must be bit-identical on both sides of an edge, on every compiler: no fused multiply-add behind our back,
  # and not GCC 12's vectoriser of straight-line code, which drops the rounding of (double)(float)x on neighbouring members.
  target_compile_options(${target} PRIVATE ${RELIEF_WARNINGS} -ffp-contract=off -fno-tree-slp-vectorize
                                           $<$<BOOL:${RELIEF_WERROR}>:-Werror>)
  if(RELIEF_SANITIZE)
    target_compile_options(${target} PUBLIC -fsanitize=${RELIEF_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
    target_link_options(${target} PUBLIC -fsanitize=${RELIEF_SANITIZE})
  endif()
endfunction()

function(relief_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(relief_${name} STATIC ${arg_SOURCES})
  add_library(relief::${name} ALIAS relief_${name})
  relief_compile_options(relief_${name})
  target_include_directories(relief_${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
                                                   $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(relief_${name} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
  set_target_properties(relief_${name} PROPERTIES EXPORT_NAME ${name} OUTPUT_NAME relief_${name})
  set_property(GLOBAL APPEND PROPERTY RELIEF_LIBRARIES relief_${name})
endfunction()
