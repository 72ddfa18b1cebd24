// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// For LD_PRELOAD: counts the calls of a program that concern files below the folders of
// MONO3D_FAULT_PATHS (separated by colons), the decoding of images and the memory that the program
// itself asks for, and lets one of them fail (see fault_point.h). MONO3D_FAULT_ERRNO: another error
// than the usual one of the kind.

#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <link.h>
#include <stdarg.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <new>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <string_view>

// clang-format off: it needs what stands before it
#include <jpeglib.h>
// clang-format on
#include <png.h>

#include "faults/fault_point.h"

extern "C" void* __libc_malloc(std::size_t num_bytes);  // NOLINT: glibc's own name

namespace {

using mono3d::faults::FaultPoint;

// Smaller pieces of memory do not run out first.
constexpr std::size_t kLeastBytes = std::size_t{64} << 10;
constexpr int kMaxDescriptors = 4096;

enum Kind {
  kOpen,
  kOpenStream,
  kRead,
  kWrite,
  kFlush,
  kSync,
  kClose,
  kRename,
  kMakeFolder,
  kRemove,
  kLink,
  kListFolder,
  kMap,
  kDecodeImage,
  kDecodeVideo,
  kMemory,
  kImageMemory,
  kNumKinds
};

constinit std::array<FaultPoint, kNumKinds> file_points = {
    FaultPoint("open"),   FaultPoint("open_stream"),  FaultPoint("read"),
    FaultPoint("write"),  FaultPoint("flush"),        FaultPoint("sync"),
    FaultPoint("close"),  FaultPoint("rename"),       FaultPoint("make_folder"),
    FaultPoint("remove"), FaultPoint("link"),         FaultPoint("list_folder"),
    FaultPoint("map"),    FaultPoint("decode_image"), FaultPoint("decode_video"),
    FaultPoint("memory"), FaultPoint("image_memory")};

constexpr std::array<int, kNumKinds> kUsualErrors = {EMFILE, ENOMEM, EIO,    ENOSPC, ENOSPC, EIO,
                                                     EIO,    EIO,    ENOSPC, EACCES, EPERM,  EMFILE,
                                                     ENOMEM, 0,      0,      0,      0};

constinit std::array<std::atomic<bool>, kMaxDescriptors> is_watched{};

bool IsBelow(const char* path) {
  const char* folders = std::getenv("MONO3D_FAULT_PATHS");
  if (folders == nullptr || path == nullptr) return false;
  std::string_view rest = folders;
  while (!rest.empty()) {
    const std::string_view folder = rest.substr(0, rest.find(':'));
    if (std::string_view(path).starts_with(folder)) return true;
    rest.remove_prefix(std::min(rest.size(), folder.size() + 1));
  }
  return false;
}

bool IsWatched(int descriptor) {
  return descriptor >= 0 && descriptor < kMaxDescriptors && is_watched[descriptor];
}

bool IsWatched(std::FILE* file) { return file != nullptr && IsWatched(fileno(file)); }

int Watch(int descriptor, bool watched) {
  if (descriptor >= 0 && descriptor < kMaxDescriptors) is_watched[descriptor] = watched;
  return descriptor;
}

// Whether this call, which concerns the run if `concerns`, fails; errno says why then.
bool Fails(Kind kind, bool concerns) {
  if (!concerns || !file_points[kind].IsDue()) return false;
  const char* other = std::getenv("MONO3D_FAULT_ERRNO");
  errno = other != nullptr ? std::atoi(other) : kUsualErrors[kind];
  return true;
}

template <typename Function>
Function* Next(Function* /*type*/, const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

// Where the program itself lies: what its libraries ask for is not ours to handle.
struct Extent {
  std::uintptr_t begin = 0;
  std::uintptr_t end = 0;
};

Extent ExtentOfProgram() {
  Extent extent;
  dl_iterate_phdr(
      [](dl_phdr_info* info, std::size_t, void* data) {
        auto& found = *static_cast<Extent*>(data);
        for (int i = 0; i < info->dlpi_phnum; ++i) {
          const ElfW(Phdr)& header = info->dlpi_phdr[i];
          if (header.p_type != PT_LOAD || (header.p_flags & PF_X) == 0) continue;
          found.begin = info->dlpi_addr + header.p_vaddr;
          found.end = found.begin + header.p_memsz;
        }
        return 1;  // the first one is the program
      },
      &extent);
  return extent;
}

constinit Extent program;
constinit std::atomic<bool> has_begun = false;

bool IsOfProgram(void* caller) {
  const auto address = reinterpret_cast<std::uintptr_t>(caller);
  return has_begun && address >= program.begin && address < program.end;
}

void* NewMemory(std::size_t num_bytes, std::size_t alignment, void* caller) {
  const bool concerns = num_bytes >= kLeastBytes && IsOfProgram(caller);
  if (Fails(kMemory, concerns)) throw std::bad_alloc();
  void* memory = nullptr;
  if (alignment == 0) {
    memory = __libc_malloc(num_bytes == 0 ? 1 : num_bytes);
  } else if (posix_memalign(&memory, alignment, num_bytes) != 0) {
    memory = nullptr;
  }
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

[[gnu::constructor]] void Begin() {
  program = ExtentOfProgram();
  has_begun = true;
}

[[gnu::destructor]] void End() { mono3d::faults::ReportCounts(file_points); }

mode_t ModeOf(int flags, va_list list) {
  return (flags & (O_CREAT | O_TMPFILE)) != 0 ? static_cast<mode_t>(va_arg(list, int)) : 0;
}

}  // namespace

// The next function of this name: what would have been called.
#define MONO3D_NEXT(name) static const auto next = Next(&::name, #name)

#define MONO3D_OPEN(name)                                                          \
  int name(const char* path, int flags, ...) {                                     \
    va_list list;                                                                  \
    va_start(list, flags);                                                         \
    const mode_t mode = ModeOf(flags, list);                                       \
    va_end(list);                                                                  \
    static const auto next =                                                       \
        reinterpret_cast<int (*)(const char*, int, ...)>(dlsym(RTLD_NEXT, #name)); \
    const bool concerns = IsBelow(path);                                           \
    if (Fails(kOpen, concerns)) return -1;                                         \
    return Watch(next(path, flags, mode), concerns);                               \
  }

#define MONO3D_FOPEN(name)                                                                   \
  std::FILE* name(const char* path, const char* mode) {                                      \
    static const auto next =                                                                 \
        reinterpret_cast<std::FILE* (*)(const char*, const char*)>(dlsym(RTLD_NEXT, #name)); \
    const bool concerns = IsBelow(path);                                                     \
    if (Fails(kOpen, concerns)) return nullptr;                                              \
    std::FILE* file = next(path, mode);                                                      \
    if (file != nullptr) Watch(fileno(file), concerns);                                      \
    return file;                                                                             \
  }

extern "C" {

MONO3D_OPEN(open)
MONO3D_OPEN(open64)
MONO3D_FOPEN(fopen)
MONO3D_FOPEN(fopen64)

int mkstemp(char* path) {
  MONO3D_NEXT(mkstemp);
  const bool concerns = IsBelow(path);
  if (Fails(kOpen, concerns)) return -1;
  return Watch(next(path), concerns);
}

std::FILE* fdopen(int descriptor, const char* mode) noexcept {
  MONO3D_NEXT(fdopen);
  if (Fails(kOpenStream, IsWatched(descriptor))) return nullptr;
  return next(descriptor, mode);
}

ssize_t read(int descriptor, void* data, std::size_t num_bytes) {
  MONO3D_NEXT(read);
  if (Fails(kRead, IsWatched(descriptor))) return -1;
  return next(descriptor, data, num_bytes);
}

ssize_t __read_chk(int descriptor, void* data, std::size_t num_bytes, std::size_t) {
  return read(descriptor, data, num_bytes);
}

std::size_t fread(void* data, std::size_t size, std::size_t count, std::FILE* file) {
  MONO3D_NEXT(fread);
  if (Fails(kRead, IsWatched(file))) return 0;
  return next(data, size, count, file);
}

ssize_t write(int descriptor, const void* data, std::size_t num_bytes) {
  MONO3D_NEXT(write);
  if (Fails(kWrite, IsWatched(descriptor))) return -1;
  return next(descriptor, data, num_bytes);
}

ssize_t writev(int descriptor, const iovec* parts, int count) {
  MONO3D_NEXT(writev);
  if (Fails(kWrite, IsWatched(descriptor))) return -1;
  return next(descriptor, parts, count);
}

std::size_t fwrite(const void* data, std::size_t size, std::size_t count, std::FILE* file) {
  MONO3D_NEXT(fwrite);
  if (Fails(kWrite, IsWatched(file))) return 0;
  return next(data, size, count, file);
}

int fflush(std::FILE* file) {
  MONO3D_NEXT(fflush);
  if (Fails(kFlush, IsWatched(file))) return EOF;
  return next(file);
}

int fsync(int descriptor) {
  MONO3D_NEXT(fsync);
  if (Fails(kSync, IsWatched(descriptor))) return -1;
  return next(descriptor);
}

int fdatasync(int descriptor) {
  MONO3D_NEXT(fdatasync);
  if (Fails(kSync, IsWatched(descriptor))) return -1;
  return next(descriptor);
}

int close(int descriptor) {
  MONO3D_NEXT(close);
  const bool fails = Fails(kClose, IsWatched(descriptor));
  const int error = errno;
  Watch(descriptor, false);
  const int result = next(descriptor);
  if (!fails) return result;
  errno = error;
  return -1;
}

int fclose(std::FILE* file) {
  MONO3D_NEXT(fclose);
  const bool fails = Fails(kClose, IsWatched(file));
  const int error = errno;
  Watch(fileno(file), false);
  const int result = next(file);
  if (!fails) return result;
  errno = error;
  return EOF;
}

int rename(const char* from, const char* to) noexcept {
  MONO3D_NEXT(rename);
  if (Fails(kRename, IsBelow(from) || IsBelow(to))) return -1;
  return next(from, to);
}

int renameat2(int from_folder, const char* from, int to_folder, const char* to,
              unsigned flags) noexcept {
  MONO3D_NEXT(renameat2);
  if (Fails(kRename, IsBelow(from) || IsBelow(to))) return -1;
  return next(from_folder, from, to_folder, to, flags);
}

int mkdir(const char* path, mode_t mode) noexcept {
  MONO3D_NEXT(mkdir);
  if (Fails(kMakeFolder, IsBelow(path))) return -1;
  return next(path, mode);
}

int unlink(const char* path) noexcept {
  MONO3D_NEXT(unlink);
  if (Fails(kRemove, IsBelow(path))) return -1;
  return next(path);
}

int remove(const char* path) noexcept {
  MONO3D_NEXT(remove);
  if (Fails(kRemove, IsBelow(path))) return -1;
  return next(path);
}

int rmdir(const char* path) noexcept {
  MONO3D_NEXT(rmdir);
  if (Fails(kRemove, IsBelow(path))) return -1;
  return next(path);
}

int unlinkat(int folder, const char* path, int flags) noexcept {
  MONO3D_NEXT(unlinkat);
  if (Fails(kRemove, IsBelow(path) || IsWatched(folder))) return -1;
  return next(folder, path, flags);
}

int symlink(const char* from, const char* to) noexcept {
  MONO3D_NEXT(symlink);
  if (Fails(kLink, IsBelow(to))) return -1;
  return next(from, to);
}

int openat(int folder, const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const mode_t mode = ModeOf(flags, list);
  va_end(list);
  static const auto next =
      reinterpret_cast<int (*)(int, const char*, int, ...)>(dlsym(RTLD_NEXT, "openat"));
  const bool concerns = IsBelow(path) || IsWatched(folder);
  if (Fails(kOpen, concerns)) return -1;
  return Watch(next(folder, path, flags, mode), concerns);
}

DIR* fdopendir(int descriptor) {
  MONO3D_NEXT(fdopendir);
  if (Fails(kListFolder, IsWatched(descriptor))) return nullptr;
  return next(descriptor);
}

dirent* readdir(DIR* folder) {
  MONO3D_NEXT(readdir);
  if (Fails(kListFolder, IsWatched(dirfd(folder)))) return nullptr;
  return next(folder);
}

int closedir(DIR* folder) {
  MONO3D_NEXT(closedir);
  Watch(dirfd(folder), false);
  return next(folder);
}

DIR* opendir(const char* path) {
  MONO3D_NEXT(opendir);
  if (Fails(kListFolder, IsBelow(path))) return nullptr;
  return next(path);
}

void* mmap(void* address, std::size_t num_bytes, int protection, int flags, int descriptor,
           off_t offset) noexcept {
  MONO3D_NEXT(mmap);
  const bool is_of_program = descriptor < 0 && IsOfProgram(__builtin_return_address(0));
  if (Fails(kMap, IsWatched(descriptor) || is_of_program)) return MAP_FAILED;
  return next(address, num_bytes, protection, flags, descriptor, offset);
}

// What Eigen calls.
void* malloc(std::size_t num_bytes) {
  const bool concerns = num_bytes >= kLeastBytes && IsOfProgram(__builtin_return_address(0));
  if (Fails(kMemory, concerns)) {
    errno = ENOMEM;
    return nullptr;
  }
  return __libc_malloc(num_bytes);
}

// Decoders fail as they do on damaged data: by the functions that they were given for it.
boolean jpeg_start_decompress(j_decompress_ptr info) {
  static const auto next = Next(&jpeg_start_decompress, "jpeg_start_decompress");
  if (Fails(kDecodeImage, true)) info->err->error_exit(reinterpret_cast<j_common_ptr>(info));
  return next(info);
}

void png_read_update_info(png_structrp png, png_inforp info) {
  static const auto next = Next(&png_read_update_info, "png_read_update_info");
  if (Fails(kDecodeImage, true)) png_error(png, "asked for by MONO3D_FAULT");
  next(png, info);
}

}  // extern "C"

void* operator new(std::size_t num_bytes) {
  return NewMemory(num_bytes, 0, __builtin_return_address(0));
}

void* operator new[](std::size_t num_bytes) {
  return NewMemory(num_bytes, 0, __builtin_return_address(0));
}

void* operator new(std::size_t num_bytes, std::align_val_t alignment) {
  return NewMemory(num_bytes, static_cast<std::size_t>(alignment), __builtin_return_address(0));
}

namespace cv {

void* fastMalloc(std::size_t num_bytes) {
  static const auto next =
      reinterpret_cast<void* (*)(std::size_t)>(dlsym(RTLD_NEXT, "_ZN2cv10fastMallocEm"));
  if (Fails(kImageMemory, num_bytes >= kLeastBytes)) {
    CV_Error(cv::Error::StsNoMem, "asked for by MONO3D_FAULT");
  }
  return next(num_bytes);
}

// Of the other forms; fails as a decoder does: without an image.
Mat imdecode(InputArray data, int flags) {
  static const auto next = reinterpret_cast<Mat (*)(InputArray, int)>(
      dlsym(RTLD_NEXT, "_ZN2cv8imdecodeERKNS_11_InputArrayEi"));
  if (Fails(kDecodeImage, true)) return {};
  return next(data, flags);
}

bool VideoCapture::grab() {
  static const auto next =
      reinterpret_cast<bool (*)(VideoCapture*)>(dlsym(RTLD_NEXT, "_ZN2cv12VideoCapture4grabEv"));
  if (Fails(kDecodeVideo, true)) return false;
  return next(this);
}

bool VideoCapture::retrieve(OutputArray image, int flag) {
  static const auto next = reinterpret_cast<bool (*)(VideoCapture*, OutputArray, int)>(
      dlsym(RTLD_NEXT, "_ZN2cv12VideoCapture8retrieveERKNS_12_OutputArrayEi"));
  if (Fails(kDecodeVideo, true)) return false;
  return next(this, image, flag);
}

}  // namespace cv
