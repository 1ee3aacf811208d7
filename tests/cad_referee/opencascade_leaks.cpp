// OpenCASCADE keeps tables of its own until the process ends. The leak sanitizer asks this function what is not ours;
// without that sanitizer nobody calls it.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libTK\n"; }
