/* Prints the poses of a live session as CSV: poses HOST PORT SESSION COUNT [TOKEN]. The last column has the aids with something
 * wrong: the number of each from 0, its kind of trouble, and the seconds since it last corrected (655 and more: long ago, or never).
 *
 *     cc -O2 -o poses poses.c
 *
 * C99 and POSIX sockets alone. The frame is laid out in docs/poses.md; this reads it on a little-endian machine. */
#define _POSIX_C_SOURCE 200112L
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { HEAD_BYTES = 40, BODY_BYTES = 132, AID_BYTES = 4 };

static void fail(const char *why) {
    fprintf(stderr, "%s\n", why);
    exit(1);
}

static void take(int fd, void *into, size_t length) {
    char *at = into;
    while (length > 0) {
        ssize_t got = read(fd, at, length);
        if (got <= 0) fail("expected more poses, found the end: the socket was closed");
        at += got;
        length -= (size_t)got;
    }
}

static void give(int fd, const void *from, size_t length) {
    const char *at = from;
    while (length > 0) {
        ssize_t put = write(fd, at, length);
        if (put <= 0) fail("the socket takes nothing");
        at += put;
        length -= (size_t)put;
    }
}

static int reach(const char *host, const char *port) {
    struct addrinfo wanted = {0}, *found, *at;
    wanted.ai_socktype = SOCK_STREAM;
    if (getaddrinfo(host, port, &wanted, &found) != 0) fail("expected a host and a port, found none of that name");
    int fd = -1, on = 1;
    for (at = found; at && fd < 0; at = at->ai_next) {
        fd = socket(at->ai_family, at->ai_socktype, at->ai_protocol);
        if (fd >= 0 && connect(fd, at->ai_addr, at->ai_addrlen) != 0) {
            close(fd);
            fd = -1;
        }
    }
    freeaddrinfo(found);
    if (fd < 0) fail("nobody answers there");
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    return fd;
}

/* The handshake of a websocket (RFC 6455). The key is for proxies that keep answers, of which there is none here. */
static void open_socket(int fd, char **argv, const char *token) {
    char text[1024];
    int length = snprintf(text, sizeof text,
                          "GET /api/v1/sessions/%s/poses HTTP/1.1\r\nHost: %s:%s\r\nUpgrade: websocket\r\n"
                          "Connection: Upgrade\r\nSec-WebSocket-Key: bG9kZXN0ZXAgcG9zZXMgIQ==\r\n"
                          "Sec-WebSocket-Version: 13\r\n%s%s%s\r\n",
                          argv[3], argv[1], argv[2], token ? "Authorization: Bearer " : "", token ? token : "",
                          token ? "\r\n" : "");
    if (length < 0 || length >= (int)sizeof text) fail("expected a shorter session or token");
    give(fd, text, (size_t)length);
    size_t got = 0;
    while (got < 4 || memcmp(text + got - 4, "\r\n\r\n", 4) != 0) {
        if (got + 1 >= sizeof text) fail("expected an answer, found too long a one");
        take(fd, text + got++, 1);
    }
    if (memcmp(text, "HTTP/1.1 101", 12) != 0) fail("expected 101, found another answer: check session and token");
}

/* The next message: its opcode, its content in `content`, its length in `length`. */
static int next_message(int fd, unsigned char *content, size_t most, size_t *length) {
    unsigned char head[8];
    take(fd, head, 2);
    int opcode = head[0] & 15;
    *length = head[1] & 127;
    if (*length == 126) {
        take(fd, head, 2);
        *length = (size_t)head[0] << 8 | head[1];
    }
    if (*length >= most) fail("expected a message of a few hundred bytes, found a longer one");
    take(fd, content, *length);
    return opcode;
}

static double number(const unsigned char *at) {
    double value;
    memcpy(&value, at, sizeof value);
    return value;
}

static float small(const unsigned char *at) {
    float value;
    memcpy(&value, at, sizeof value);
    return value;
}

static void print_pose(const unsigned char *frame) {
    uint64_t sequence, aids;
    int64_t t_ns;
    uint32_t age_us, flags;
    memcpy(&sequence, frame + 8, 8);
    memcpy(&t_ns, frame + 16, 8);
    memcpy(&age_us, frame + 24, 4);
    memcpy(&aids, frame + 32, 8);
    const int bodies = frame[30], count = frame[31];
    printf("%llu,%.9f,%u,%u,%llx", (unsigned long long)sequence, 1e-9 * (double)t_ns, age_us, frame[28],
           (unsigned long long)aids);
    for (int body = 0; body < bodies; body++) {
        const unsigned char *at = frame + HEAD_BYTES + body * BODY_BYTES;
        memcpy(&flags, at + 128, 4);
        printf(",%.6f,%.6f,%.6f,%.8f,%.8f,%.8f,%.6f,%u,%u", number(at), number(at + 8), number(at + 16),
               number(at + 24), number(at + 32), number(at + 40), small(at + 120), flags >> 2 & 1, flags >> 3 & 1);
    }
    printf(",");
    for (int aid = 0; aid < count; aid++) {
        uint16_t since, trouble;
        const unsigned char *at = frame + HEAD_BYTES + bodies * BODY_BYTES + aid * AID_BYTES;
        memcpy(&since, at, 2);
        memcpy(&trouble, at + 2, 2);
        if (trouble) printf("%d:%u:%.2f;", aid, trouble, since / 100.0);
    }
    printf("\n");
    fflush(stdout);
}

/* Whether this is a frame of version 2 that is as long as it says. */
static int is_frame(const unsigned char *content, size_t length) {
    uint16_t told;
    if (length < HEAD_BYTES || memcmp(content, "LPOS\2\0", 6) != 0) return 0;
    memcpy(&told, content + 6, 2);
    return told == length && length == (size_t)(HEAD_BYTES + content[30] * BODY_BYTES + content[31] * AID_BYTES);
}

int main(int argc, char **argv) {
    if (argc != 5 && argc != 6) fail("poses HOST PORT SESSION COUNT [TOKEN]");
    unsigned char content[4096], pong[136] = {0x8a};
    size_t length;
    int fd = reach(argv[1], argv[2]);
    open_socket(fd, argv, argc == 6 ? argv[5] : NULL);
    printf("sequence,t_s,age_us,state,aids");
    for (int body = 0; body < 2; body++) printf(",e_m,n_m,u_m,yaw_rad,pitch_rad,roll_rad,protection_level_m,valid,alarm");
    printf(",trouble\n");
    for (long told = 0; told < atol(argv[4]);) {
        int opcode = next_message(fd, content, sizeof content, &length);
        if (opcode == 8) fail("expected more poses, found the end: the socket was closed");
        if (opcode == 9 && length <= 125) {
            /* A mask of zeros leaves the content as it is. */
            pong[1] = (unsigned char)(0x80 | length);
            memset(pong + 2, 0, 4);
            memcpy(pong + 6, content, length);
            give(fd, pong, 6 + length);
        }
        if (opcode != 2) continue;
        if (!is_frame(content, length)) fail("expected a frame of version 2, found another: see docs/poses.md");
        print_pose(content);
        told++;
    }
    close(fd);
    return 0;
}
