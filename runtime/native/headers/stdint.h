/* What the kernel takes of <stdint.h>, for the compiler that comes with mechc: no header of the system is needed. */
typedef int int32_t;
typedef unsigned uint32_t;
typedef long int64_t;
typedef unsigned long uint64_t;
typedef unsigned long uintptr_t;
