#include "test/support.hpp"

#include <atomic>
#include <cstdlib>
#include <new>

#include <unistd.h>

namespace cyclops::test {
namespace {

thread_local std::uint64_t allocations = 0;
std::atomic<int> serial{0};

}  // namespace

void count_allocation() { ++allocations; }

HeapGuard::HeapGuard() : start_(allocations) {}
std::uint64_t HeapGuard::count() const { return allocations - start_; }

TempDir::TempDir()
    : path_(std::filesystem::temp_directory_path() /
            ("cyclops-test-" + std::to_string(::getpid()) + "-" + std::to_string(serial++))) {
  std::filesystem::create_directories(path_);
}
TempDir::~TempDir() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace cyclops::test

// Every C++ allocation of the test program passes here, so that a test can prove that a hot path makes none.
void* operator new(std::size_t n) {
  cyclops::test::count_allocation();
  if (void* p = std::malloc(n != 0 ? n : 1)) return p;
  throw std::bad_alloc();
}
void* operator new(std::size_t n, const std::nothrow_t&) noexcept {  // std::stable_sort asks this way
  cyclops::test::count_allocation();
  return std::malloc(n != 0 ? n : 1);
}
void* operator new(std::size_t n, std::align_val_t a) {
  cyclops::test::count_allocation();
  void* p = nullptr;
  if (posix_memalign(&p, static_cast<std::size_t>(a), n != 0 ? n : 1) == 0) return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, const std::nothrow_t&) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }
