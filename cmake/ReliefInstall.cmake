# cmake --install: libraries, public headers, the program, and a package that find_package(Relief) reads. Each part has an
# export set of its own, so that find_package(Relief COMPONENTS core) asks for nothing that core does not need.
include(CMakePackageConfigHelpers)

set(RELIEF_CMAKE_DIR "${CMAKE_INSTALL_LIBDIR}/cmake/Relief")

# How an installed package finds each foreign target that a part links; a static library hands its needs on.
set(relief_find_Threads::Threads "find_dependency(Threads)")
set(relief_find_TBB::tbb "find_dependency(TBB)")
set(relief_find_embree "find_dependency(embree 3)")
set(relief_find_ZLIB::ZLIB "find_dependency(ZLIB)")
set(relief_find_nlohmann_json::nlohmann_json "find_dependency(nlohmann_json)")
set(relief_find_fmt::fmt "find_dependency(fmt)")
set(relief_find_SQLite::SQLite3 "find_dependency(SQLite3)")
set(relief_find_PNG::PNG "find_dependency(PNG)")
set(relief_find_JPEG::JPEG "find_dependency(JPEG)")
set(relief_find_draco::draco "find_dependency(draco)")
set(relief_find_meshoptimizer::meshoptimizer "find_dependency(meshoptimizer)")
set(relief_find_PkgConfig::zstd "relief_find_pkg_config(zstd libzstd)")
set(relief_find_PkgConfig::epoxy "relief_find_pkg_config(epoxy epoxy)")
set(relief_find_PkgConfig::freetype "relief_find_pkg_config(freetype freetype2)")
set(relief_find_PkgConfig::fontconfig "relief_find_pkg_config(fontconfig fontconfig)")

# relief_install_part(TARGET): installs one library; adds to RELIEF_PARTS_CODE what the package must know about it.
function(relief_install_part target)
  get_target_property(part ${target} EXPORT_NAME)
  get_target_property(links ${target} LINK_LIBRARIES)
  set(needs "")
  set(finds "")
  foreach(link IN LISTS links)
    if(link MATCHES "^relief::(.+)$")
      list(APPEND needs "${CMAKE_MATCH_1}")
    elseif(DEFINED "relief_find_${link}")
      list(APPEND finds "${relief_find_${link}}")
    elseif(link MATCHES "^(m|dl|rt|pthread|-.*)$" OR link STREQUAL "links-NOTFOUND" OR link MATCHES "^\\$<BUILD_INTERFACE:")
      # Headers that only our own sources read leave nothing for an installed Relief to find.
      continue()
    else()
      message(FATAL_ERROR "cmake/ReliefInstall.cmake must say how an installed Relief finds ${link}, which ${part} links")
    endif()
  endforeach()

  install(TARGETS ${target} EXPORT Relief-${part}
    ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT development)
  install(EXPORT Relief-${part} NAMESPACE relief:: DESTINATION "${RELIEF_CMAKE_DIR}" COMPONENT development)
  set(headers ${relief_public_headers})
  list(FILTER headers INCLUDE REGEX "^relief/${part}/")
  list(TRANSFORM headers PREPEND "${PROJECT_SOURCE_DIR}/")
  install(FILES ${headers} DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/relief/${part}" COMPONENT development)

  list(JOIN needs " " needs)
  list(JOIN finds "\n    " finds)
  set(RELIEF_PARTS_CODE "${RELIEF_PARTS_CODE}
set(relief_needs_${part} ${needs})
macro(relief_find_needs_of_${part})
    ${finds}
endmacro()
" PARENT_SCOPE)
endfunction()

# The public headers; all others are internal to their part and stay here.
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${CMAKE_CURRENT_LIST_DIR}/public-headers.txt")
file(STRINGS "${CMAKE_CURRENT_LIST_DIR}/public-headers.txt" relief_public_headers)

get_property(relief_libraries GLOBAL PROPERTY RELIEF_LIBRARIES)
set(RELIEF_PARTS "")
set(RELIEF_PARTS_CODE "")
foreach(target IN LISTS relief_libraries)
  relief_install_part(${target})
  get_target_property(part ${target} EXPORT_NAME)
  list(APPEND RELIEF_PARTS ${part})
endforeach()

configure_package_config_file("${CMAKE_CURRENT_LIST_DIR}/ReliefConfig.cmake.in" "${CMAKE_CURRENT_BINARY_DIR}/ReliefConfig.cmake"
  INSTALL_DESTINATION "${RELIEF_CMAKE_DIR}")
write_basic_package_version_file("${CMAKE_CURRENT_BINARY_DIR}/ReliefConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/ReliefConfig.cmake" "${CMAKE_CURRENT_BINARY_DIR}/ReliefConfigVersion.cmake"
  DESTINATION "${RELIEF_CMAKE_DIR}" COMPONENT development)

if(TARGET relief_cli)
  install(TARGETS relief_cli RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT runtime)
  install(DIRECTORY "${CMAKE_BINARY_DIR}/share/" DESTINATION "${CMAKE_INSTALL_DATADIR}" COMPONENT runtime)
endif()
if(TARGET relief_studio)
  install(TARGETS relief_studio RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT runtime)
endif()
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" "${PROJECT_SOURCE_DIR}/NOTICE" "${PROJECT_SOURCE_DIR}/README.md"
  DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT runtime)
