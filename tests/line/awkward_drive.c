/* A drive with awkward habits on libmodbus, for tests: `awkward_drive drivecom|bits PATH DEVICE`.
 *
 * It answers after 30 ms, reads 8 words at most and none over a hole, has no function 43 (it is
 * silent there), and keeps 32-bit values with the high word first. Of the words only those exist
 * that are named below. It plays one of two charts:
 *
 *   drivecom  command 8501, reference 8502, status 3201, frequency 3202, fault 7121
 *   bits      command 8192, reference 8193, reset 8194, fault 8448, status 8742, frequency 8451
 *
 * SIGUSR1 trips it; SIGTERM ends it, and it says how many requests it has refused. */
#include <errno.h>
#include <modbus.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { WORDS = 65536, LONGEST = 8, TURNAROUND_US = 30000, LOOK_US = 100000 };
enum { READ = 3, READ_INPUT = 4, WRITE = 6, WRITE_MANY = 16 };

static volatile sig_atomic_t ended, tripping;
static uint8_t exists[WORDS], writable[WORDS], has_input[WORDS];
static modbus_mapping_t *map;
static int drivecom;
static unsigned refused;

static void on_signal(int number)
{
    if (number == SIGUSR1)
        tripping = 1;
    else
        ended = 1;
}

static void fail(const char *what)
{
    fprintf(stderr, "%s: %s\n", what, modbus_strerror(errno));
    exit(1);
}

static uint16_t *word(int address)
{
    return &map->tab_registers[address];
}

static void has(int address, uint16_t value, int may_write)
{
    exists[address] = 1;
    writable[address] = (uint8_t)may_write;
    *word(address) = value;
}

static void make_drivecom(void)
{
    has(3201, 0x0250, 0); /* switch on disabled, supplied */
    has(3202, 0, 0);
    has(3204, 0, 0);
    has(3207, 5370, 0);
    has(3230, 1, 0); /* hours, high word first: 65536 + 4464 = 70000 */
    has(3231, 4464, 0);
    has(7121, 0, 0);
    has(8501, 0, 1);
    has(8502, 0, 1);
    has(8504, 0, 1);
    has(9001, 30, 1);
    has(9002, 30, 1);
    has(3104, 500, 1);
    has(3105, 0, 1);
    has(3110, 0x0021, 1); /* fields of one word */
}

static void make_bits(void)
{
    has(8192, 0, 1);
    has(8193, 0, 1);
    has(8194, 0, 1);
    has(8448, 0, 0); /* warning and fault, a byte each */
    has(8449, 0, 0);
    has(8451, 0, 0);
    has(8452, 0, 0);
    has(8742, 0x0004, 0); /* ready */
    has(0x2260, 1, 0);
    has(0x2261, 4464, 0);
    has(256, 6000, 1);
    has(268, 1000, 1);
    has(269, 1000, 1);
    has(2306, 1, 1);
    has(2307, 0, 1);
    has(300, 0x0021, 1);
    has_input[100] = 1;
    map->tab_input_registers[100] = 417;
}

/* What becomes of the drive once a word was written, or it trips. */
static void play_drivecom(int written)
{
    static uint16_t before;
    uint16_t command = *word(8501);
    uint16_t state = *word(3201) & 0x006F;
    if (tripping) {
        state = 0x0008;
        *word(7121) = 9;
    } else if (state == 0x0008) {
        if (written == 8501 && (command & 0x80) && !(before & 0x80)) {
            state = 0x0040;
            *word(7121) = 0;
        }
    } else if (written == 8501) {
        uint16_t wanted = command & 0x0F;
        if (!(command & 2))
            state = 0x0040;
        else if (wanted == 0x06)
            state = state == 0x0040 || state != 0 ? 0x0021 : state;
        else if (wanted == 0x07 && state != 0x0040)
            state = 0x0023;
        else if (wanted == 0x0F && state != 0x0040)
            state = 0x0027;
    }
    before = command;
    *word(3201) = 0x0210 | state;
    if (state == 0x0027)
        *word(3202) = command & 0x0800 ? (uint16_t)-*word(8502) : *word(8502);
    else
        *word(3202) = 0;
    *word(3204) = state == 0x0027 ? 21 : 0;
    if (state == 0x0027 && (command & 0x0800))
        *word(3201) |= 0x8000;
    tripping = 0;
}

static void play_bits(int written)
{
    static int runs, reverse;
    if (tripping) {
        *word(8448) = 0x0006; /* over-current while it accelerates */
        runs = 0;
    } else if (written == 8194 && (*word(8194) & 2)) {
        *word(8448) = 0;
    } else if (written == 8192 && *word(8448) == 0) {
        runs = (*word(8192) & 3) == 2;
        reverse = (*word(8192) & 0x30) == 0x20;
    }
    if (*word(8448) & 0xFF)
        *word(8742) = 0x0008;
    else
        *word(8742) = runs ? (reverse ? 0x0016 : 0x0015) : 0x0004;
    *word(8451) = runs ? *word(8193) : 0;
    *word(8452) = runs ? 210 : 0;
    tripping = 0;
}

static void play(int written)
{
    if (drivecom)
        play_drivecom(written);
    else
        play_bits(written);
}

/* The exception that a request earns, or 0. */
static int refusal(int function, int address, int count)
{
    if (function != READ && function != READ_INPUT && function != WRITE && function != WRITE_MANY)
        return MODBUS_EXCEPTION_ILLEGAL_FUNCTION;
    if (drivecom && (function == READ_INPUT || function == WRITE_MANY))
        return MODBUS_EXCEPTION_ILLEGAL_FUNCTION;
    if (count > LONGEST || count < 1)
        return MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE;
    for (int at = address; at < address + count; at++) {
        const uint8_t *known = function == READ_INPUT ? has_input : exists;
        if (at >= WORDS || !known[at])
            return MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS;
        if ((function == WRITE || function == WRITE_MANY) && !writable[at])
            return MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS;
    }
    return 0;
}

static void answer(modbus_t *bus, const uint8_t *query, int length)
{
    int head = modbus_get_header_length(bus);
    int function = query[head];
    int address = query[head + 1] << 8 | query[head + 2];
    int value = query[head + 3] << 8 | query[head + 4];
    int no = refusal(function, address, function == WRITE ? 1 : value);
    usleep(TURNAROUND_US);
    refused += no != 0;
    if (no)
        modbus_reply_exception(bus, query, (unsigned)no);
    else
        modbus_reply(bus, query, length, map);
    if (!no && (function == WRITE || function == WRITE_MANY))
        play(address);
}

int main(int count, char **arguments)
{
    struct sigaction action = {.sa_handler = on_signal};
    uint8_t query[MODBUS_RTU_MAX_ADU_LENGTH];
    if (count != 4) {
        fprintf(stderr, "usage: awkward_drive drivecom|bits PATH DEVICE\n");
        return 2;
    }
    drivecom = strcmp(arguments[1], "drivecom") == 0;
    map = modbus_mapping_new(0, 0, WORDS, WORDS);
    modbus_t *bus = modbus_new_rtu(arguments[2], 9600, 'N', 8, 1);
    if (map == NULL || bus == NULL || modbus_set_slave(bus, atoi(arguments[3])) < 0
        || modbus_connect(bus) < 0)
        fail(arguments[2]);
    if (drivecom)
        make_drivecom();
    else
        make_bits();
    sigaction(SIGUSR1, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    modbus_set_indication_timeout(bus, 0, LOOK_US);
    printf("ready on %s\n", arguments[2]);
    fflush(stdout);
    while (!ended) {
        int length = modbus_receive(bus, query);
        if (tripping)
            play(0);
        if (length > 0) {
            answer(bus, query, length);
        } else if (length < 0 && errno != ETIMEDOUT && errno != EINTR) {
            usleep(LOOK_US); /* no frame that it knows: all of it goes by */
            modbus_flush(bus);
        }
    }
    fprintf(stderr, "%u", refused);
    return 0;
}
