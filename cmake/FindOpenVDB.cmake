# OpenVDB::openvdb. Debian's own find module asks for libraries that only its tools need.
include(CMakeFindDependencyMacro)
find_path(OpenVDB_INCLUDE_DIR openvdb/openvdb.h)
find_library(OpenVDB_LIBRARY openvdb)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenVDB REQUIRED_VARS OpenVDB_LIBRARY OpenVDB_INCLUDE_DIR)
mark_as_advanced(OpenVDB_INCLUDE_DIR OpenVDB_LIBRARY)
if(OpenVDB_FOUND AND NOT TARGET OpenVDB::openvdb)
  find_dependency(TBB)
  find_dependency(Imath)
  add_library(OpenVDB::openvdb UNKNOWN IMPORTED)
  set_target_properties(OpenVDB::openvdb PROPERTIES IMPORTED_LOCATION "${OpenVDB_LIBRARY}"
    INTERFACE_SYSTEM_INCLUDE_DIRECTORIES "${OpenVDB_INCLUDE_DIR}" INTERFACE_LINK_LIBRARIES "Imath::Imath;TBB::tbb")
endif()
