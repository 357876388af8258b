# Target footfall::estimator. FOOTFALL_PROCESSOR is the folder of src with its library, or `generic` for the file of C.
#
# If you do not set FOOTFALL_PROCESSOR, it follows from the macros that the compiler of C or C++ defines with the
# options of CMAKE_C_FLAGS or CMAKE_CXX_FLAGS, and of add_compile_options() so far.

# Asks the compiler for its macros. `reason` is empty, or the reason why they are unknown.
function(_footfall_macros macros reason)
  set(${macros} "" PARENT_SCOPE)
  set(${reason} "" PARENT_SCOPE)
  if(CMAKE_C_COMPILER)
    set(language C)
  elseif(CMAKE_CXX_COMPILER)
    set(language CXX)
  else()
    set(${reason} "the project enables neither C nor C++" PARENT_SCOPE)
    return()
  endif()
  separate_arguments(options UNIX_COMMAND "${CMAKE_${language}_COMPILER_ARG1} ${CMAKE_${language}_FLAGS}")
  # Those with generator expressions are not known yet.
  get_directory_property(of_folder COMPILE_OPTIONS)
  string(GENEX_STRIP "${of_folder}" of_folder)
  foreach(option IN LISTS of_folder)
    string(REGEX REPLACE "^SHELL:" "" option "${option}")
    separate_arguments(option UNIX_COMMAND "${option}")
    list(APPEND options ${option})
  endforeach()
  if(CMAKE_${language}_COMPILER_TARGET)
    list(APPEND options "--target=${CMAKE_${language}_COMPILER_TARGET}")
  endif()
  list(LENGTH CMAKE_OSX_ARCHITECTURES architectures)
  if(APPLE AND architectures GREATER 1)
    set(${reason} "the libraries are for one processor each, CMAKE_OSX_ARCHITECTURES names several" PARENT_SCOPE)
    return()
  elseif(APPLE AND architectures EQUAL 1)
    list(APPEND options -arch "${CMAKE_OSX_ARCHITECTURES}")
  endif()
  set(empty "${CMAKE_BINARY_DIR}/CMakeFiles/footfall_empty.c")
  file(WRITE "${empty}" "")
  execute_process(
    COMMAND "${CMAKE_${language}_COMPILER}" ${options} -x c -dM -E "${empty}"
    OUTPUT_VARIABLE defined ERROR_VARIABLE errors RESULT_VARIABLE failed)
  if(failed)
    set(${reason} "${CMAKE_${language}_COMPILER} does not list its macros: ${errors}" PARENT_SCOPE)
  endif()
  set(${macros} "${defined}" PARENT_SCOPE)
endfunction()

# Folder of the library for the compiler, or empty with the reason.
function(_footfall_processor processor reason)
  set(${reason} "" PARENT_SCOPE)
  if(MSVC)
    set(found "")
    if("${CMAKE_C_COMPILER_ARCHITECTURE_ID};${CMAKE_CXX_COMPILER_ARCHITECTURE_ID}" MATCHES "x64")
      set(found windows/x86_64)
    endif()
    set(${processor} "${found}" PARENT_SCOPE)
    return()
  endif()
  _footfall_macros(macros unknown)
  if(unknown)
    set(${reason} "${unknown}" PARENT_SCOPE)
    set(${processor} "" PARENT_SCOPE)
    return()
  endif()
  # Patterns of all macros that have to be defined, with the folder. The first that fits wins.
  set(m4 "__ARM_ARCH_7EM__ ")
  set(m33 "__ARM_ARCH_8(_1)?M_MAIN__ ")
  set(rows
    "__ARM_ARCH_6M__ \;cortex-m0"
    "__ARM_ARCH_7M__ \;cortex-m3"
    "__ARM_ARCH_8M_BASE__ \;cortex-m23"
    "${m4}\;__ARM_PCS_VFP \;cortex-m4/fpv4-sp-d16-hard"
    "${m4}\;__ARM_FP \;cortex-m4/fpv4-sp-d16-softfp"
    "${m4}\;cortex-m4"
    "${m33}\;__ARM_PCS_VFP \;cortex-m33/fpv5-sp-d16-hard"
    "${m33}\;__ARM_FP \;cortex-m33/fpv5-sp-d16-softfp"
    "${m33}\;cortex-m33"
    "__riscv_xlen 32\;__riscv_mul \;__riscv_(compressed|zca) \;__riscv_float_abi_single \;riscv32/ilp32f"
    "__riscv_xlen 32\;__riscv_mul \;__riscv_(compressed|zca) \;__riscv_float_abi_soft \;riscv32"
    "__APPLE__ \;__aarch64__ \;macos/arm64"
    "__APPLE__ \;__x86_64__ \;macos/x86_64"
    "_WIN32 \;__x86_64__ \;windows/x86_64"
    "__linux__ \;__aarch64__ \;__LP64__ \;aarch64"
    "__linux__ \;__x86_64__ \;__LP64__ \;x86_64"
    "__linux__ \;__i386__ \;i386"
    "__XTENSA__ \;generic")
  foreach(row IN LISTS rows)
    set(patterns ${row})
    list(GET patterns -1 found)
    list(REMOVE_AT patterns -1)
    foreach(pattern IN LISTS patterns)
      if(NOT macros MATCHES "#define ${pattern}")
        set(found "")
      endif()
    endforeach()
    if(found)
      break()
    endif()
  endforeach()
  set(${processor} "${found}" PARENT_SCOPE)
endfunction()

function(_footfall_find)
  get_filename_component(source "${CMAKE_CURRENT_LIST_DIR}/../src" ABSOLUTE)
  set(why "")
  if(NOT DEFINED FOOTFALL_PROCESSOR)
    _footfall_processor(processor why)
    if(NOT processor AND NOT why)
      set(why "there is no library for the processor of the compiler's options")
    endif()
  else()
    set(processor "${FOOTFALL_PROCESSOR}")
  endif()
  if(processor STREQUAL generic)
    set(library "${source}/generic/footfall_estimator.c")
  elseif(MSVC)
    set(library "${source}/${processor}/footfall_estimator.lib")
  else()
    set(library "${source}/${processor}/libfootfall_estimator.a")
  endif()
  if(NOT why AND (NOT processor OR NOT EXISTS "${library}"))
    set(why "there is no library in ${source}/${processor}")
  endif()
  if(why)
    set(footfall_estimator_FOUND FALSE PARENT_SCOPE)
    set(footfall_estimator_NOT_FOUND_MESSAGE
      "footfall_estimator: ${why}. Set FOOTFALL_PROCESSOR to a folder of ${source}, such as generic, or build one: cargo xtask library --target TARGET"
      PARENT_SCOPE)
    return()
  endif()
  set(FOOTFALL_PROCESSOR "${processor}" PARENT_SCOPE)
  if(processor STREQUAL generic AND NOT TARGET footfall::estimator)
    add_library(footfall_estimator_generic STATIC "${library}")
    target_include_directories(footfall_estimator_generic PUBLIC "${source}")
    target_compile_definitions(footfall_estimator_generic PRIVATE FOOTFALL_GENERIC)
    if(CMAKE_C_COMPILER_ID MATCHES "GNU|Clang")
      target_compile_options(footfall_estimator_generic PRIVATE -ffp-contract=off)
    endif()
    add_library(footfall::estimator ALIAS footfall_estimator_generic)
  elseif(NOT TARGET footfall::estimator)
    add_library(footfall::estimator STATIC IMPORTED GLOBAL)
    set_target_properties(footfall::estimator PROPERTIES
      IMPORTED_LOCATION "${library}"
      INTERFACE_INCLUDE_DIRECTORIES "${source}")
  endif()
endfunction()

_footfall_find()
