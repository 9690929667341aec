/* A disk that a test can take the power from, or fill: preloaded into limberd (LD_PRELOAD), it watches the files
 * directly below a folder and keeps a second folder, the image: what would be on the disk if the power went now.
 *
 * A write reaches the image when its file is synced. Before that, each piece of 512 bytes may reach it at any time, or
 * not, in any order, as a system writes back: here it does at once with a given probability, by a seeded choice. The
 * image is right whenever the process is killed, and is then put in the folder's place.
 *
 * DISK_FOLDER, DISK_IMAGE   both are there already
 * DISK_EARLY                probability [%] that a piece is written back before a sync (50)
 * DISK_SEED                 of the choice (1)
 * DISK_IGNORES_SYNC         set: a sync succeeds and does nothing, as on a disk that lies
 * DISK_SYNC_MS              that a sync takes at least (0)
 * DISK_FULL                 a file: while it is there, writes fail with ENOSPC
 * DISK_BROKEN               a file: while it is there, syncs fail with EIO
 *
 * Files that are mapped are not watched: of SQLite that is NAME-shm, which is made anew after a crash.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

enum { kPiece = 512, kFiles = 64, kDescriptors = 4096 };

struct change { /* a write, or without bytes a new length */
  struct change *next;
  off_t at;
  size_t size;
  unsigned char bytes[];
};

struct file {
  char name[256];
  int image;
  int is_removed; /* here, and not yet in the image */
  struct change *first, **end;
};

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static struct file files[kFiles];
static int file_count;
static struct file *file_of[kDescriptors]; /* null: not watched */
static char is_folder[kDescriptors];
static const char *folder, *image;
static uint64_t state = 1;
static unsigned early = 50;
static int ignores_sync;
static unsigned sync_ms;

static int (*real_open)(const char *, int, ...);
static int (*real_close)(int);
static ssize_t (*real_write)(int, const void *, size_t);
static ssize_t (*real_pwrite)(int, const void *, size_t, off_t);
static int (*real_ftruncate)(int, off_t);
static int (*real_fsync)(int);
static int (*real_fdatasync)(int);
static int (*real_unlink)(const char *);

__attribute__((constructor)) static void prepare(void) {
  real_open = dlsym(RTLD_NEXT, "open64");
  real_close = dlsym(RTLD_NEXT, "close");
  real_write = dlsym(RTLD_NEXT, "write");
  real_pwrite = dlsym(RTLD_NEXT, "pwrite64");
  real_ftruncate = dlsym(RTLD_NEXT, "ftruncate64");
  real_fsync = dlsym(RTLD_NEXT, "fsync");
  real_fdatasync = dlsym(RTLD_NEXT, "fdatasync");
  real_unlink = dlsym(RTLD_NEXT, "unlink");
  folder = getenv("DISK_FOLDER");
  image = getenv("DISK_IMAGE");
  if (getenv("DISK_SEED")) state = strtoull(getenv("DISK_SEED"), NULL, 10) * 2654435761u + 1;
  if (getenv("DISK_EARLY")) early = (unsigned)atoi(getenv("DISK_EARLY"));
  ignores_sync = getenv("DISK_IGNORES_SYNC") != NULL;
  if (getenv("DISK_SYNC_MS") != NULL) sync_ms = (unsigned)atoi(getenv("DISK_SYNC_MS"));
}

static void fail(const char *what) {
  dprintf(2, "disk: %s: %s\n", what, strerror(errno));
  abort();
}

/* splitmix64 */
static int is_early(void) {
  uint64_t z = (state += 0x9e3779b97f4a7c15u);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return (z ^ (z >> 31)) % 100 < early;
}

static int is_there(const char *variable) {
  const char *path = getenv(variable);
  return path != NULL && access(path, F_OK) == 0;
}

/* The name below the folder; null: elsewhere, or not watched. */
static const char *name_of(const char *path) {
  if (folder == NULL || image == NULL) return NULL;
  size_t length = strlen(folder);
  if (strncmp(path, folder, length) != 0 || path[length] != '/') return NULL;
  const char *name = path + length + 1;
  size_t size = strlen(name);
  if (size == 0 || size > 200 || strchr(name, '/')) return NULL;
  if (size > 4 && strcmp(name + size - 4, "-shm") == 0) return NULL;
  return name;
}

static void image_path(const char *name, char *path, size_t size) { snprintf(path, size, "%s/%s", image, name); }

static void apply(struct file *file, const struct change *change) {
  if (change->size == 0) {
    if (real_ftruncate(file->image, change->at) != 0) fail("the image cannot be cut");
  } else if (real_pwrite(file->image, change->bytes, change->size, change->at) != (ssize_t)change->size) {
    fail("the image cannot be written");
  }
}

static void forget(struct file *file) {
  while (file->first != NULL) {
    struct change *next = file->first->next;
    free(file->first);
    file->first = next;
  }
  file->end = &file->first;
}

static void remove_from_image(struct file *file) {
  char path[4096];
  image_path(file->name, path, sizeof path);
  real_unlink(path);
  if (file->image >= 0) real_close(file->image);
  file->image = -1;
  file->is_removed = 0;
  forget(file);
}

static struct file *watch(const char *name) {
  struct file *file = NULL;
  for (int i = 0; i < file_count; ++i) {
    if (strcmp(files[i].name, name) == 0) file = &files[i];
  }
  if (file == NULL) {
    if (file_count == kFiles) fail("too many files");
    file = &files[file_count++];
    snprintf(file->name, sizeof file->name, "%s", name);
    file->image = -1;
    file->end = &file->first;
  }
  if (file->is_removed) remove_from_image(file);
  return file;
}

static void open_image(struct file *file) {
  char path[4096];
  if (file->image >= 0) return;
  image_path(file->name, path, sizeof path);
  file->image = real_open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (file->image < 0) fail(path);
}

/* Of a change that was made: kept until a sync, and some of it written back at once. */
static void note(struct file *file, off_t at, const void *bytes, size_t size) {
  struct change *change = malloc(sizeof *change + size);
  if (change == NULL) fail("no memory");
  change->next = NULL;
  change->at = at;
  change->size = size;
  if (size > 0) memcpy(change->bytes, bytes, size);
  *file->end = change;
  file->end = &change->next;
  if (size == 0) {
    if (is_early()) {
      open_image(file);
      apply(file, change);
    }
    return;
  }
  for (size_t i = 0; i < size;) { /* pieces of the disk, not of the write */
    size_t piece = kPiece - (size_t)((at + (off_t)i) % kPiece);
    if (piece > size - i) piece = size - i;
    if (is_early()) {
      open_image(file);
      if (real_pwrite(file->image, change->bytes + i, piece, at + (off_t)i) != (ssize_t)piece) fail("write back");
    }
    i += piece;
  }
}

static struct file *watched(int descriptor) {
  return descriptor >= 0 && descriptor < kDescriptors ? file_of[descriptor] : NULL;
}

static int opened(const char *path, int flags, mode_t mode) {
  if (real_open == NULL) prepare(); /* another library's constructor was earlier */
  int descriptor = real_open(path, flags, mode);
  if (descriptor < 0 || descriptor >= kDescriptors || folder == NULL) return descriptor;
  const char *name = name_of(path);
  pthread_mutex_lock(&lock);
  is_folder[descriptor] = strcmp(path, folder) == 0;
  if (name != NULL && (flags & O_ACCMODE) != O_RDONLY) {
    file_of[descriptor] = watch(name);
    if (flags & O_TRUNC) note(file_of[descriptor], 0, NULL, 0);
  }
  pthread_mutex_unlock(&lock);
  return descriptor;
}

#define OPENS(function)                           \
  int function(const char *path, int flags, ...) { \
    mode_t mode = 0;                              \
    if (flags & (O_CREAT | __O_TMPFILE)) {        \
      va_list rest;                               \
      va_start(rest, flags);                      \
      mode = va_arg(rest, mode_t);                \
      va_end(rest);                               \
    }                                             \
    return opened(path, flags, mode);             \
  }
OPENS(open)
OPENS(open64)
int __open_2(const char *path, int flags) { return opened(path, flags, 0); }
int __open64_2(const char *path, int flags) { return opened(path, flags, 0); }

int close(int descriptor) {
  if (descriptor >= 0 && descriptor < kDescriptors) {
    pthread_mutex_lock(&lock);
    file_of[descriptor] = NULL;
    is_folder[descriptor] = 0;
    pthread_mutex_unlock(&lock);
  }
  return real_close(descriptor);
}

static ssize_t no_room(void) {
  errno = ENOSPC;
  return -1;
}

ssize_t write(int descriptor, const void *bytes, size_t size) {
  struct file *file = watched(descriptor);
  if (file == NULL) return real_write(descriptor, bytes, size);
  if (is_there("DISK_FULL")) return no_room();
  pthread_mutex_lock(&lock);
  off_t at = lseek(descriptor, 0, SEEK_CUR);
  ssize_t written = real_write(descriptor, bytes, size);
  if (written > 0) note(file, at, bytes, (size_t)written);
  pthread_mutex_unlock(&lock);
  return written;
}

ssize_t pwrite64(int descriptor, const void *bytes, size_t size, off_t at) {
  struct file *file = watched(descriptor);
  if (file == NULL) return real_pwrite(descriptor, bytes, size, at);
  if (is_there("DISK_FULL")) return no_room();
  pthread_mutex_lock(&lock);
  ssize_t written = real_pwrite(descriptor, bytes, size, at);
  if (written > 0) note(file, at, bytes, (size_t)written);
  pthread_mutex_unlock(&lock);
  return written;
}
ssize_t pwrite(int descriptor, const void *bytes, size_t size, off_t at) {
  return pwrite64(descriptor, bytes, size, at);
}

int ftruncate64(int descriptor, off_t length) {
  struct file *file = watched(descriptor);
  if (file == NULL) return real_ftruncate(descriptor, length);
  pthread_mutex_lock(&lock);
  int result = real_ftruncate(descriptor, length);
  if (result == 0) note(file, length, NULL, 0);
  pthread_mutex_unlock(&lock);
  return result;
}
int ftruncate(int descriptor, off_t length) { return ftruncate64(descriptor, length); }

static void sync_file(struct file *file) {
  open_image(file);
  for (const struct change *change = file->first; change != NULL; change = change->next) apply(file, change);
  forget(file);
}

static int synced(int descriptor, int (*real)(int)) {
  struct file *file = watched(descriptor);
  int of_folder = descriptor >= 0 && descriptor < kDescriptors && is_folder[descriptor];
  if (file == NULL && !of_folder) return real(descriptor);
  if (is_there("DISK_BROKEN")) {
    errno = EIO;
    return -1;
  }
  if (ignores_sync) return 0;
  if (sync_ms > 0) usleep(1000 * sync_ms);
  pthread_mutex_lock(&lock);
  if (file != NULL && !file->is_removed) sync_file(file);
  if (of_folder) {
    for (int i = 0; i < file_count; ++i) {
      if (files[i].is_removed) remove_from_image(&files[i]);
    }
  }
  pthread_mutex_unlock(&lock);
  return 0;
}
int fsync(int descriptor) { return synced(descriptor, real_fsync); }
int fdatasync(int descriptor) { return synced(descriptor, real_fdatasync); }

int unlink(const char *path) {
  int result = real_unlink(path);
  const char *name = result == 0 ? name_of(path) : NULL;
  if (name == NULL) return result;
  pthread_mutex_lock(&lock);
  struct file *file = watch(name);
  file->is_removed = 1;
  if (is_early()) remove_from_image(file);
  pthread_mutex_unlock(&lock);
  return result;
}
