/* Options that AddressSanitizer asks a program for by these names; without it they are functions that nobody
 * calls. */

/* Its leak check guesses wrong where libraries that are loaded late (OpenImageIO, OpenCL drivers) keep
 * thread-local storage, and dies of it. */
const char *__asan_default_options(void);
const char *__asan_default_options(void)
{
    return "intercept_tls_get_addr=0";
}

/* The same for the leak check on its own. */
const char *__lsan_default_options(void);
const char *__lsan_default_options(void)
{
    return "intercept_tls_get_addr=0:print_suppressions=0";
}

/* Leaks of others: PoCL and LLVM when they compile; fontconfig's and graphviz's configuration; without the
 * guess above OpenImageIO's last message (a C++ string per thread) seems lost. Objects of OpenCL that we
 * forget look like PoCL's: tests/count_cl.h counts them. */
const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void)
{
    return "leak:libLLVM\nleak:libpocl\nleak:libclang\nleak:libfontconfig\nleak:libgvc\nleak:basic_string*_M_"
           "assign\n";
}
