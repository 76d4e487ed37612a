#pragma once

/// Names for clang's thread-safety attributes; nothing for other compilers. Clang builds check them (-Wthread-safety): a member
/// marked POSED_GUARDED_BY(mutex_) that is touched without the lock does not compile. See
/// https://clang.llvm.org/docs/ThreadSafetyAnalysis.html.
#if defined(__clang__)
#define POSED_THREAD_ATTRIBUTE(x) __attribute__((x))
#else
#define POSED_THREAD_ATTRIBUTE(x)
#endif

/// On a class that is a lock, and on a class that holds one for its lifetime.
#define POSED_CAPABILITY(name) POSED_THREAD_ATTRIBUTE(capability(name))
#define POSED_SCOPED_CAPABILITY POSED_THREAD_ATTRIBUTE(scoped_lockable)

/// On data: which mutex must be held to touch it (for the second, what the pointer points to).
#define POSED_GUARDED_BY(mutex) POSED_THREAD_ATTRIBUTE(guarded_by(mutex))
#define POSED_PT_GUARDED_BY(mutex) POSED_THREAD_ATTRIBUTE(pt_guarded_by(mutex))

/// On functions: what the caller must hold or must not hold.
#define POSED_REQUIRES(...) POSED_THREAD_ATTRIBUTE(requires_capability(__VA_ARGS__))
#define POSED_EXCLUDES(...) POSED_THREAD_ATTRIBUTE(locks_excluded(__VA_ARGS__))

/// On functions of locks themselves.
#define POSED_ACQUIRE(...) POSED_THREAD_ATTRIBUTE(acquire_capability(__VA_ARGS__))
#define POSED_RELEASE(...) POSED_THREAD_ATTRIBUTE(release_capability(__VA_ARGS__))
#define POSED_TRY_ACQUIRE(...) POSED_THREAD_ATTRIBUTE(try_acquire_capability(__VA_ARGS__))
