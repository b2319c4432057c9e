# What is built only to check something runs once, and is built faster as it stands; CMake would say -O3.
set(CMAKE_C_FLAGS_RELEASE "" CACHE STRING "")
set(CMAKE_CXX_FLAGS_RELEASE "" CACHE STRING "")

# Unoptimised, a compiler mostly reads headers: once for many sources. Some have names that others of their library have too.
set(CMAKE_UNITY_BUILD ON)
set(CMAKE_UNITY_BUILD_BATCH_SIZE 16)
function(alone target)
    foreach(source ${ARGN})
        set(path "${CMAKE_SOURCE_DIR}/${source}")
        cmake_language(EVAL CODE "cmake_language(DEFER DIRECTORY [[${CMAKE_SOURCE_DIR}]] CALL set_source_files_properties
            [[${path}]] TARGET_DIRECTORY ${target} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)")
    endforeach()
endfunction()
set(tools spirv-tools/source)
if(EXISTS "${CMAKE_SOURCE_DIR}/${tools}")
    alone(SPIRV-Tools-static ${tools}/spirv_reducer_options.cpp ${tools}/val/validate_ray_tracing_reorder.cpp)
    alone(SPIRV-Tools-opt ${tools}/opt/basic_block.cpp ${tools}/opt/ir_context.cpp ${tools}/opt/local_single_block_elim_pass.cpp
        ${tools}/opt/local_single_store_elim_pass.cpp ${tools}/opt/mem_pass.cpp ${tools}/opt/reduce_load_size.cpp)
    alone(glslang glslang/SPIRV/SpvBuilder.cpp)
    cmake_language(EVAL CODE "cmake_language(DEFER DIRECTORY [[${CMAKE_SOURCE_DIR}]] CALL
        set_target_properties SPIRV-Tools-reduce PROPERTIES UNITY_BUILD OFF)")
endif()
