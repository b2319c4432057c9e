# What is built only to check something runs once, and is built faster as it stands; CMake would say -O3.
set(CMAKE_C_FLAGS_RELEASE "" CACHE STRING "")
set(CMAKE_CXX_FLAGS_RELEASE "" CACHE STRING "")
