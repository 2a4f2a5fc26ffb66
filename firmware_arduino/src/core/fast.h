// To be included first by the files whose code runs in every tick. Arduino compiles for size; between
// the calls of soft float that costs the tick cycles and stack. Other compilers are not asked.
#ifdef __AVR__
#pragma GCC optimize("O2")
#endif
